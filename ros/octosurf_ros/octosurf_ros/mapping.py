"""The map and its thread: scans wait in a queue for their poses, and what is asked is done between two of them."""

import collections
import concurrent.futures
import itertools
import os
import re
import threading
import time
import typing

import numpy as np
import octosurf

from octosurf_ros.messages import class_of

PAUSE_NS = 10**9  # without a scan, by time stamps, as `octosurf map`
PATIENCE_S = 5  # then it is said what does not come
SCANS_OF_SEARCH = 16  # at most, spread over those since it began
SCANS_OF_VERDICT = 100  # which takes 0.1 s, as much as a few of them


def stem_of(name):
    """A map's name without the ending of either of its files."""
    return re.sub(r"\.(surfaces|bt)$", "", name)


def is_there(stem):
    return any(os.path.lexists(stem + ending) for ending in (".surfaces", ".bt"))


def beside(stem):
    """NAME-2, NAME-3, ...: the first that is no map's."""
    return next(one for n in itertools.count(2) if not is_there(one := re.sub(r"-\d+$", "", stem) + f"-{n}"))


def own_box(text):
    """(frame or "", low, high) of '[FRAME] X Y Z X Y Z'."""
    words = text.split()
    frame = words.pop(0) if len(words) == 7 else ""
    numbers = [float(word) for word in words]
    if len(numbers) != 6:
        raise ValueError(f"self_box: '{text}' is not [FRAME] X Y Z X Y Z, two corners in metres")
    return frame, numbers[:3], numbers[3:]


class Sensor:
    """What scans come from: a topic, with the parameters of its own."""

    def __init__(self, topic, type, own):
        self.topic, self.type, self.depth, self.reliable = topic, type, type.endswith("Image"), own["reliable"]
        compressed = self.depth and topic.endswith("/compressedDepth")  # as image_transport names it
        if compressed:
            self.type = "sensor_msgs/CompressedImage"
        self.message = class_of(self.type)
        self.info = own["camera_info"] or octosurf.camera_info_topic(topic, compressed)
        self.kind = {"": None, "camera": "depth_camera", "lidar": "lidar"}[own["sensor"]]  # of clouds
        self.units = own["depth_scale"] or None
        self.no_return = [one for one in own["no_return"] if one > 0]
        self.own = [own_box(one) for one in own["self_box"] if one]

    def read(self, message, camera):
        if not self.depth:
            return octosurf.scan_from_cloud(message, sensor=self.kind, type=self.type)
        if camera is None:
            raise RuntimeError("no CameraInfo has come yet")
        return octosurf.scan_from_depth(message, camera, rectified=octosurf.is_rectified(self.topic),
                                        depth_scale=self.units, type=self.type)


class Ground:
    """A map's index and grounds, each made of the one before."""

    def __init__(self, up):
        self.up, self.lock, self.snapshot, self.indexed, self.views = up, threading.Lock(), None, None, {}

    def index(self, snapshot):
        with self.lock:
            if self.snapshot is not snapshot:
                self.indexed = octosurf.SurfaceIndex(snapshot, self.indexed)
                self.snapshot = snapshot
            return self.indexed

    def view(self, snapshot, rules):
        unseen = rules.widest_unseen_m
        kind = rules.as_mapped, octosurf.widest_unseen_of(rules.foot) if unseen is None else unseen
        with self.lock:
            of, view = self.views.pop(kind, (None, None))
            if view is None:
                view = octosurf.GroundView(snapshot, snapshot.octree, rules)
            elif of is not snapshot:
                view = view.next(snapshot, snapshot.octree)
            self.views[kind] = snapshot, view
            for oldest in list(self.views)[:-8]:  # a client may ask for any foot
                del self.views[oldest]
        return view.by(rules)

    def bare(self, snapshot):
        """Outlines without voids; no unseen gaps are bridged."""
        rules = octosurf.GroundRules.of(octosurf.Biped(), snapshot.resolution)
        rules.limits.up, rules.widest_unseen_m = self.up, 0
        return self.view(snapshot, rules)


class Moment(typing.NamedTuple):
    """The map after some scan."""

    snapshot: octosurf.Snapshot
    ground: Ground  # of this map: another one where the map is another
    stamp_ns: int  # of the last scan mapped since the node was started
    place: np.ndarray | None  # where it was taken from


class Mapping:
    def __init__(self, start, stem, options, log):
        self.options, self.log, self.stem, self.lock = options, log, stem_of(stem), octosurf.MapLock(stem)
        names = "received", "mapped", "rejected", "refused", "dropped", "transforms", "messages_refused"
        self.counts = dict.fromkeys(names, 0)
        self.last_refusal, self.scan_ms, self.told = "", 0.0, 0.0
        self.corrected = None  # or a function of T_map_odom and each scan's time
        self.tf, self.cameras, self.unposed = octosurf.Transforms(), {}, {}  # of sensors without a pose, since when
        self.news = threading.Condition()  # of what follows
        self.queue, self.bytes, self.tasks = collections.deque(), 0, collections.deque()
        self.ended = self.hurried = self.changed = False
        self.saved, self.last_stamp_ns, self.failure = time.monotonic(), None, None
        self.over = None  # why nothing is done any more
        self.moment = Moment(None, None, 0, None)
        self.use(start)
        self.thread = threading.Thread(target=self.run, name="mapping")  # whoever makes it starts it, when all is there

    def use(self, start):
        self.mapper = octosurf.Mapper(start, self.options.threads)
        self.mapper.share_octree()
        self.mapper.remember_scans()
        up = start.parameters().up
        ground = Ground(np.array([0.0, 0.0, 1.0]) if up is None else up)  # z: REP 103
        self.moment = self.moment._replace(snapshot=self.mapper.snapshot(), ground=ground)
        self.judge, self.judged, self.contradiction = octosurf.RecordingJudge(start.parameters()), 0, ""
        self.T_map_given, self.sought, self.place = None, None, ""
        if self.options.locate and len(self.moment.snapshot):
            self.look()

    def look(self, low=None, high=None):
        """Maps nothing until scans have found `odom` in the map, from anywhere or for a last one in this box."""
        if not self.options.publish_tf:
            raise ValueError("what is found is published as `frame` -> `odom`; give publish_tf, too")
        self.localizer, self.box = octosurf.Localizer(self.mapper.map()), (low, high)
        self.sought, self.came, self.every, self.place = [], 0, 1, "waiting for a scan"
        return "looking for the place; status says what is known"

    # What comes, from the executor's thread.

    def add_scan(self, sensor, message, sent_ns):
        with self.news:
            self.counts["received"] += 1
            self.queue.append((sensor, message, sent_ns, time.monotonic()))
            self.bytes += len(message)
            while self.bytes > self.options.queue << 20:  # so that mapping stays near the robot's place
                if self.counts["dropped"] == 0:
                    self.log.warning("scans come faster than they are mapped; the oldest make way, status counts them")
                self.bytes -= len(self.queue.popleft()[1])
                self.counts["dropped"] += 1
            self.news.notify_all()

    def add_transforms(self, message, fixed):
        try:
            warning = self.tf.add(message, fixed)
        except Exception as error:
            return self.refuse(f"tf: {error}", "messages_refused")
        with self.news:
            self.counts["transforms"] += 1
            self.news.notify_all()
        if warning:
            self.last_refusal = warning
            self.log.warning(warning)

    def add_camera(self, sensor, message):
        try:
            octosurf.require_camera(message, rectified=octosurf.is_rectified(sensor.topic))
        except Exception as error:
            return self.refuse(f"CameraInfo: {error}", "messages_refused")
        with self.news:
            self.cameras[sensor] = message
            self.news.notify_all()

    def refuse(self, what, count):
        """A message that cannot be used, whatever a reader raises, ends nothing."""
        what = what.encode(errors="backslashreplace").decode()  # a name of any bytes is no text for rclpy
        self.counts[count] += 1
        self.last_refusal = what
        if time.monotonic() - self.told > 1:  # a faulty sensor must not flood the log
            self.told = time.monotonic()
            self.log.warning(f"refused: {what} ({self.counts[count]} so far)")

    def base_pose(self):
        """T_map_base at the newest time at which it is known, and that time."""
        frame, base = self.options.frame, self.options.base
        stamp_ns = self.tf.newest(frame, base)
        if stamp_ns is None:
            raise RuntimeError(f"tf does not connect {base} with {frame}")
        return self.tf.lookup(frame, base, stamp_ns), stamp_ns

    # The thread.

    def run(self):
        over = RuntimeError("the node ends")
        try:
            while True:
                with self.news:
                    self.news.wait_for(lambda: self.tasks or self.queue or self.ended, 1)
                    if self.hurried or self.ended and not self.queue and not self.tasks:
                        return
                    task = self.tasks.popleft() if self.tasks else None
                    scan = self.queue.popleft() if self.queue and not task else None
                    self.bytes -= len(scan[1]) if scan else 0
                if task:
                    task()
                if scan:
                    self.map_scan(*scan)
                self.save_checkpoint()
        except BaseException as error:  # the map is incomplete: finish() says why
            self.failure = over = error
        finally:
            with self.news:
                self.over = over
                while self.tasks:
                    self.tasks.popleft()(over)

    def posed(self, sensor, message, sent_ns, came):
        """By a transform at the scan's time or after it, for which it waits; else by what is there, as a bag's last."""
        def wait(ready):
            with self.news:
                self.news.wait_for(lambda: self.ended or ready(), max(0, came + self.options.wait - time.monotonic()))

        wait(lambda: not sensor.depth or sensor in self.cameras)
        camera = self.cameras.get(sensor)
        received = sensor.read(message, camera)
        stamp_ns = received.stamp_ns or sent_ns
        frames = [self.options.given, *(box[0] for box in sensor.own if box[0])]

        def ready():
            known = [self.tf.newest(one, received.frame) for one in frames]
            return all(newest is not None and newest >= stamp_ns for newest in known)

        wait(ready)
        if self.tf.newest(frames[0], received.frame) is None:
            since = self.unposed.setdefault(sensor, time.monotonic())
            if time.monotonic() - since > PATIENCE_S:
                self.unposed[sensor] = np.inf  # said
                self.log.warning(f"no transform between {frames[0]} and {received.frame}, the frame of {sensor.topic}: "
                                 f"is {self.options.tf} complete, and `frame` right?")
        poses = [self.tf.lookup(one, received.frame, stamp_ns) for one in frames]
        moving = iter(poses[1:])
        own = [(low, high, next(moving) if box else np.eye(4)) for box, low, high in sensor.own]
        name = f"{sensor.topic} at {stamp_ns / 1e9:.3f} s"
        return received.posed(poses[0], name=name, no_return=sensor.no_return, own=own), stamp_ns

    def find_place(self, scan, stamp_ns):
        self.came += 1
        if self.came % self.every:
            return
        self.sought.append(scan)
        if len(self.sought) > SCANS_OF_SEARCH:
            self.sought, self.every = self.sought[1::2], 2 * self.every
        there = self.localizer.find(self.sought, *self.box)
        self.place = f"{there.finding} after {self.came} scans"
        if there.finding == "found":
            self.T_map_given, self.sought, self.place = there.T_map_scans, None, ""
            self.log.info(f"found the place in the map by {self.came} scans")
            self.corrected(self.T_map_given, stamp_ns)

    def map_scan(self, sensor, *message):
        try:
            scan, stamp_ns = self.posed(sensor, *message)
            if self.sought is not None:
                return self.find_place(scan, stamp_ns)
            if self.T_map_given is not None:
                scan = scan.with_pose(self.T_map_given @ scan.T_map_sensor)
            if self.last_stamp_ns is not None and abs(stamp_ns - self.last_stamp_ns) > PAUSE_NS:
                self.mapper.drain()
            report = self.mapper.insert(scan)
        except Exception as error:
            if getattr(error, "kind", "") == "incomplete":
                raise
            return self.refuse(f"{sensor.topic}: {str(error) or repr(error)}", "refused")
        self.last_stamp_ns, self.changed, self.scan_ms = stamp_ns, True, report.total_ms
        T_map_sensor = report.alignment.T_map_sensor
        self.moment = Moment(self.mapper.snapshot(), self.moment.ground, stamp_ns, T_map_sensor[:3, 3])
        rejected = report.alignment.outcome == "rejected"
        self.counts["rejected" if rejected else "mapped"] += 1
        if rejected:
            return
        if self.corrected:
            correction = T_map_sensor @ np.linalg.inv(scan.T_map_sensor)
            self.corrected(correction if self.T_map_given is None else correction @ self.T_map_given, stamp_ns)
        self.judge.add(scan, T_map_sensor)
        self.judged += 1
        if self.judged % SCANS_OF_VERDICT == 0:
            verdict = self.judge.judge().describe()
            if verdict and not self.contradiction:
                self.log.warning(verdict)
            self.contradiction = verdict

    def save_checkpoint(self):
        every = self.options.checkpoint
        if every <= 0 or not self.changed or time.monotonic() - self.saved < every:
            return
        self.saved = time.monotonic()
        try:
            octosurf.save(self.mapper.map(), self.stem)
            self.changed = False
        except Exception as error:  # no space or no memory: there may be some the next time
            self.log.warning(f"no checkpoint, {error}")

    # What is asked of it, from any other thread; a line of summary each.

    def between_scans(self, work):
        done = concurrent.futures.Future()

        def task(failure=None):
            try:
                if failure:
                    raise failure
                done.set_result(work())
            except BaseException as error:
                done.set_exception(error)

        with self.news:
            if self.over:
                raise self.over
            self.tasks.append(task)
            self.news.notify_all()
        return done.result()

    def kept(self, stem, what):
        snapshot = self.moment.snapshot
        return f"{stem}: {len(snapshot)} surfaces of revision {snapshot.revision} {what}"

    def save(self, stem=None):
        def work():
            to = stem_of(stem or self.stem)
            if to != self.stem and is_there(to):
                raise ValueError(f"{to} exists, and is not the node's own map; give another name")
            octosurf.save(self.mapper.map(), to)
            self.changed = self.changed and to != self.stem
            return self.kept(to, "saved")

        return self.between_scans(work)

    def go_on(self, stem, start, keep):
        """With another map, and says what became of what was mapped: it is saved as `keep`."""
        def work():
            lock, map, before = octosurf.MapLock(stem), start(), "nothing was mapped since the last save"
            if self.changed:
                octosurf.save(self.mapper.map(), keep)
                before = self.kept(keep, "saved before")
            self.use(map)
            self.lock, self.stem, self.changed = lock, stem, False
            return self.kept(stem, f"are the map, which is saved there from now on; {before}")

        done = self.between_scans(work)
        self.log.info(done)
        return done

    def load(self, stem=None):
        stem = stem_of(stem or self.stem)
        return self.go_on(stem, lambda: octosurf.load(stem), beside(stem) if stem == self.stem else self.stem)

    def reset(self):
        return self.go_on(beside(self.stem), lambda: octosurf.Map(self.mapper.map().parameters()), self.stem)

    def clear(self, part, as_free):
        def work():
            report = self.mapper.clear(part, as_free)
            self.changed = True
            self.moment = self.moment._replace(snapshot=self.mapper.snapshot())
            gone, smaller = len(report.gone), len(report.shrunk)
            return f"{report.vanished} points taken back; {gone} surfaces gone, {smaller} smaller"

        return self.between_scans(work)

    def finish(self, seconds):
        """Maps what waits, if that takes no longer, and saves. Raises what ended mapping."""
        with self.news:
            self.ended = True
            self.news.notify_all()
        self.thread.join(seconds)
        self.hurried = True
        self.thread.join()
        if self.failure:
            raise self.failure
        self.mapper.drain()
        if self.changed:
            octosurf.save(self.mapper.map(), self.stem)
        counts = ", ".join(f"{self.counts[name]} {name}" for name in ("mapped", "rejected", "refused", "dropped"))
        return f"{self.counts['received']} scans: {counts}, {len(self.queue)} not reached"


def start_of(stem, given, resume, force, cameras):
    """A new map, or the one that is there to be resumed; `given`: parameters by name, as texts."""
    there = is_there(stem_of(stem))
    if there and not resume and not force:
        raise ValueError(f"{stem} exists; `resume` goes on with it, `force` starts anew")
    if there and not force:
        loaded = octosurf.load(stem)
        kept, asked = loaded.parameters(), loaded.parameters()
        for name, text in given.items():
            asked.set(name, text)
            if asked != kept:
                raise ValueError(f"{name} is {text}, but the map that is resumed has {kept.get(name)}")
        return loaded
    # A lidar's readings are noisier, and farther apart.
    parameters = octosurf.Parameters(resolution=0.02 if cameras else 0.05)
    given = {"detection_budget": "1000", **given}  # as --realtime
    for name, text in given.items():
        parameters.set(name, text)
    if parameters.detection.detector == "paper":
        parameters = octosurf.Parameters.paper(parameters.occupancy.resolution, parameters.surfaces.sensor_noise)
        for name, text in given.items():
            parameters.set(name, text)
    parameters.validate()
    return octosurf.Map(parameters)
