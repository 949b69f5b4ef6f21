"""The node as it runs: the same maps as offline, over a kill too; what it refuses; what can be changed meanwhile."""

import copy
import math
import unittest

from ros_world import FOLDER, Node, Player, octosurf, recording_as_bag, start_ros, wait_for

import dynamic_reconfigure.client
import rospy

DEPTH = "/camera/depth/image"
CLOUD = "/lidar/points"


def files_of(stem):
    return {ending: (FOLDER / f"{stem}.{ending}").read_bytes() for ending in ("surfaces", "bt")}


class MapsAsOffline(unittest.TestCase):
    """start, map, save, kill, resume: the files of `octosurf map` over the same bag, byte for byte."""

    def check(self, name, simulate, packing, **parameters):
        bag = recording_as_bag(name, simulate, packing)
        octosurf("map", bag, "-o", FOLDER / f"{name}_offline", "--forget-scans")
        player = Player(bag)
        node = Node(map=FOLDER / f"{name}_live", **parameters).wait_until_ready()
        player.connect()
        half = len(player.scans) // 2
        player.play(node, range(half))
        saved = node.call("save", "Save")
        self.assertTrue(saved.success, saved.message)
        player.play(node, range(half, half + 1))  # is lost with the process
        node.end(9)

        node = Node(map=FOLDER / f"{name}_live", **parameters).wait_until_ready()
        self.assertTrue(node.logged("loaded"), node.log())
        player.connect()
        player.play(node, range(half, len(player.scans)))
        self.assertEqual(node.end(), 0, node.log())  # saves, as ~map is named
        status = node.status()
        self.assertEqual(status.mapped, len(player.scans) - half)
        self.assertEqual((status.dropped, status.set_aside, status.messages_refused), (0, 0, 0))
        self.assertEqual((status.scan_publishers, status.camera_publishers), (1, int("depth_topics" in parameters)))
        self.assertGreaterEqual(status.transform_publishers, 1)
        self.assertGreater(status.transforms, 0)
        player.close()
        live, offline = files_of(f"{name}_live"), files_of(f"{name}_offline")
        self.assertGreater(len(offline["surfaces"]), 1000)
        self.assertTrue(live["bt"] == offline["bt"], "the octrees differ")
        self.assertTrue(live["surfaces"] == offline["surfaces"], "the maps differ")

    def test_depth_images(self):
        self.check("depth", ["--frames", "6"], [], depth_topics=DEPTH)

    def test_depth_in_metres_through_a_chain_of_frames(self):
        self.check("metres", ["--frames", "4"], ["depth=32FC1", "poses=chain"], depth_topics=DEPTH)

    def test_clouds(self):
        self.check("cloud", ["--sensor", "spinning", "--frames", "4"], ["cloud=padded", "poses=chain"],
                   cloud_topics=CLOUD)


class Refuses(unittest.TestCase):
    """A bad message is told of and changes nothing; the next good one is mapped."""

    def setUp(self):
        self.bag = recording_as_bag("clouds", ["--sensor", "spinning", "--frames", "2"], [])
        self.images = recording_as_bag("images", ["--frames", "1"], [])
        # No budget: saving leaves to later scans what waits, the end of a run does not.
        octosurf("map", self.bag, "-o", FOLDER / "good", "--force", "--detection-budget", "0", "--forget-scans")
        self.player, self.camera = Player(self.bag), Player(self.images)
        self.node = Node(cloud_topics=CLOUD, depth_topics=DEPTH, pose_timeout=0.2,
                         mapping__detection_budget=0).wait_until_ready()
        self.player.connect()
        self.addCleanup(self.node.end)

    def refused(self, topic, message, why):
        before = self.node.status().refused
        player = self.player if topic == CLOUD else self.camera
        player.publishers[topic].publish(message)
        wait_for(lambda: self.node.status().refused > before, f"the refusal: {why}")
        self.assertEqual(self.node.status().refused, before + 1)
        self.assertIn(why, self.node.status().last_refusal)
        wait_for(lambda: self.node.logged(why), "its line in the log")

    def test_bad_messages(self):
        (_, transforms), (_, cloud) = self.player.scans[0]
        self.player.play(self.node, [0])

        wrong = copy.deepcopy(cloud)
        wrong.width += 1000000
        self.refused(CLOUD, wrong, "but holds")
        wrong = copy.deepcopy(cloud)
        wrong.fields = wrong.fields[:2]
        self.refused(CLOUD, wrong, "a cloud without one each of x, y and z")
        wrong = copy.deepcopy(cloud)
        wrong.header.frame_id = "nowhere"
        self.refused(CLOUD, wrong, "no pose of nowhere in map")
        wrong = copy.deepcopy(cloud)
        wrong.header.stamp += rospy.Duration(1000)
        self.refused(CLOUD, wrong, "no pose of lidar in map")

        messages = copy.deepcopy(dict(self.camera.scans[0]))
        info_topic = "/camera/depth/camera_info"
        info, image = messages[info_topic], messages[DEPTH]
        self.refused(DEPTH, image, "no camera")
        info.width -= 1
        self.camera.publishers[info_topic].publish(info)
        self.refused(DEPTH, image, "but its camera has")
        info.width += 1
        self.camera.publishers[info_topic].publish(info)
        uncalibrated = copy.deepcopy(info)
        uncalibrated.K = [0] * 9
        self.camera.publishers[info_topic].publish(uncalibrated)  # is not taken
        wait_for(lambda: self.node.logged("it is not calibrated"), "the camera's refusal")
        image.encoding = "rgb8"
        wait_for(lambda: self.refused_for(image, "is no depth image"), "the right camera")

        # tf itself refuses what is not finite or not of unit length; the scan is then one without a pose.
        bad = copy.deepcopy(transforms)
        bad.transforms[0].header.stamp += rospy.Duration(5)
        bad.transforms[0].transform.translation.x = math.nan
        self.player.publishers["/tf"].publish(bad)
        wait_for(lambda: self.node.logged("/tf: transform of"), "its line in the log")
        wrong = copy.deepcopy(cloud)
        wrong.header.stamp = bad.transforms[0].header.stamp
        self.refused(CLOUD, wrong, "no pose of lidar in map")
        self.assertEqual(self.node.status().messages_refused, 2)  # this one and the camera

        self.player.play(self.node, [1])
        saved = self.node.call("save", "Save", file=str(FOLDER / "live"))
        self.assertTrue(saved.success, saved.message)
        self.assertTrue(files_of("live") == files_of("good"), "the maps differ")

    def refused_for(self, image, why):
        before = self.node.status().refused
        self.camera.publishers[DEPTH].publish(image)
        wait_for(lambda: self.node.status().refused > before, "a refusal")
        return why in self.node.status().last_refusal

    def test_points_that_are_not_finite_are_no_reading(self):
        (_, transforms), (_, cloud) = self.player.scans[0]
        self.player.play(self.node, [0])
        empty = copy.deepcopy(cloud)
        empty.data = b"\xff" * len(cloud.data)  # NaN
        empty.header.stamp = transforms.transforms[0].header.stamp
        mapped = self.node.status().mapped
        self.player.publishers[CLOUD].publish(empty)
        wait_for(lambda: self.node.status().mapped > mapped, "the empty scan")
        self.assertEqual(self.node.status().refused, 0)

    def test_what_cannot_be_saved_or_loaded(self):
        self.player.play(self.node, [0])
        nothing = self.node.call("save", "Save")
        self.assertFalse(nothing.success)
        self.assertIn("~map", nothing.message)
        away = self.node.call("save", "Save", file=str(FOLDER / "no/such/folder/map"))
        self.assertFalse(away.success)
        (FOLDER / "damaged.surfaces").write_bytes((FOLDER / "good.surfaces").read_bytes()[:1000])
        revision = self.node.status().revision
        damaged = self.node.call("load", "Load", file=str(FOLDER / "damaged"))
        self.assertFalse(damaged.success)
        self.assertIn("damaged", damaged.message)
        self.assertEqual(self.node.status().revision, revision)
        self.player.play(self.node, [1])


class Parameters(unittest.TestCase):
    def test_wrong_ones_end_the_node(self):
        for parameters, why in (({}, "there is nothing to map"),
                                ({"cloud_topics": CLOUD, "mapping__resolution": "-1"}, "resolution"),
                                ({"cloud_topics": CLOUD, "mapping__colour": "red"}, "colour"),
                                ({"cloud_topics": CLOUD, "mapping__up": "x"}, "is not +z"),
                                ({"cloud_topics": CLOUD, "threads": "many"}, "~threads")):
            node = Node(**parameters)
            self.assertEqual(node.process.wait(60), 1)
            node.end()
            self.assertIn(why, node.log())

    def test_options_change_while_it_maps(self):
        bag = recording_as_bag("clouds", ["--sensor", "spinning", "--frames", "3"], [])
        player = Player(bag)
        node = Node(cloud_topics=CLOUD, mapping__resolution=0.04, mapping__detect_cylinders="false").wait_until_ready()
        self.addCleanup(node.end)
        player.connect()
        options = dynamic_reconfigure.client.Client("/octosurf", timeout=60)

        options.update_configuration({"enabled": False, "pose_timeout": 0.05})
        player.publish(0)
        wait_for(lambda: node.status().refused == 1, "the refusal")
        self.assertIn("~enabled is off", node.status().last_refusal)

        # Scans without a pose hold up the queue for a second each, so that it runs over.
        options.update_configuration({"enabled": True, "pose_timeout": 1, "queue_size": 2})
        lost = copy.deepcopy(player.scans[1][-1][1])
        lost.header.frame_id = "nowhere"
        for _ in range(6):
            player.publishers[CLOUD].publish(lost)
        wait_for(lambda: node.status().received == 7 and node.status().waiting == 0, "the flood to pass")
        status = node.status()
        self.assertGreaterEqual(status.dropped, 3)
        self.assertEqual(status.received,
                         status.mapped + status.set_aside + status.dropped + status.refused + status.waiting)
        self.assertTrue(node.logged("scans come faster than they are mapped"), node.log())

        options.update_configuration({"queue_size": 30})
        player.publish(0)
        wait_for(lambda: node.status().mapped == 1, "a scan")
        saved = node.call("save", "Save", file=str(FOLDER / "coarse"))
        self.assertTrue(saved.success, saved.message)
        self.assertIn("0.04", octosurf("info", FOLDER / "coarse"))


if __name__ == "__main__":
    start_ros()
    unittest.main(verbosity=2)
