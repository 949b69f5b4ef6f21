"""What `export --to x.mcap` writes, read by MCAP's own library and as Foxglove's own messages; test/io has the surfaces."""
import importlib
import unittest

import numpy as np
from google.protobuf.json_format import MessageToDict
from mcap.reader import NonSeekingReader, SeekingReader
from mcap_protobuf.decoder import DecoderFactory

import world


def as_foxglove_defines(schema, data):
    name = schema.name.removeprefix("foxglove.")
    return getattr(importlib.import_module(f"foxglove_schemas_protobuf.{name}_pb2"), name).FromString(data)


class Mcap(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        at = world.FOLDER / "exported"
        world.command("simulate", "stairs", "--frames", 12, "-o", world.FOLDER / "scans")
        world.command("map", world.FOLDER / "scans", "-o", at, "--resolution", 0.04, "--keep-scans", world.FOLDER / "kept",
                      "--write-poses", at.with_suffix(".txt"))
        world.command("export", at, "--to", at.with_suffix(".mcap"))
        cls.poses = np.loadtxt(at.with_suffix(".txt"))
        cls.messages = {}
        with open(at.with_suffix(".mcap"), "rb") as file:
            for schema, channel, message in SeekingReader(file, validate_crcs=True).iter_messages():
                found = as_foxglove_defines(schema, message.data)
                stamp = found.timestamp if hasattr(found, "timestamp") else found.entities[0].timestamp
                assert stamp.ToNanoseconds() == message.log_time
                cls.messages.setdefault(channel.topic, []).append(found)

    def test_follows_the_specification_and_its_own_descriptions_are_foxgloves(self):
        counts = {}
        with open(world.FOLDER / "exported.mcap", "rb") as file:
            statistics = SeekingReader(file).get_summary().statistics
            file.seek(0)
            reader = NonSeekingReader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
            for schema, channel, message, decoded in reader.iter_decoded_messages():
                self.assertEqual(message.sequence, counts.get(channel.id, 0))
                counts[channel.id] = message.sequence + 1
                self.assertEqual(MessageToDict(decoded), MessageToDict(as_foxglove_defines(schema, message.data)))
        self.assertEqual(statistics.channel_message_counts, counts)

    def test_has_the_poses(self):
        self.assertEqual(len(self.poses), 12)
        found = np.array([[one.timestamp.ToNanoseconds() * 1e-9, one.translation.x, one.translation.y, one.translation.z,
                           one.rotation.x, one.rotation.y, one.rotation.z, one.rotation.w] for one in self.messages["/tf"]])
        found[:, 4:] *= np.sign(found[:, 7] * self.poses[:, 7])[:, None]
        np.testing.assert_allclose(found, self.poses, atol=1e-6)
        self.assertEqual({(one.parent_frame_id, one.child_frame_id) for one in self.messages["/tf"]}, {("map", "sensor")})
        line = [[pose.position.x, pose.position.y, pose.position.z] for pose in self.messages["/trajectory"][0].poses]
        np.testing.assert_array_equal(line, found[:, 1:4])
