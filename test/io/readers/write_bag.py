#!/usr/bin/env python3
"""Makes bags of a recording in a folder: depth images (frame-*.depth.png) or PCD files, with poses.txt
(tx ty tz qx qy qz qw, with or without a time stamp) and camera-intrinsics.txt.

Messages and bags of ROS 1 and SQLite's are of rosbags, MCAPs of mcap, all of it independent of octosurf's reader
(test/peers installs them). Options:

packing    none, bz2 (bag), lz4, zstd (mcap)     [none]
poses      tf, chain, odometry, pose, none       [tf: map → sensor; chain: map → base → sensor, sensor's axes turned]
depth      16UC1, mono16, 32FC1, big, png, compressedDepth [16UC1]
cloud      plain, doubles, padded, big, organised [plain]
chunk      bytes of a chunk; 0: no chunks        [768 kB]
"""
import pathlib
import re
import struct
import sys
import tempfile

import mcap.writer
import numpy as np
from PIL import Image
from rosbags import rosbag1, rosbag2
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

START_NS = 1_700_000_000_000_000_000
ROS1, ROS2 = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_HUMBLE)
ROS1.register(get_types_from_msg('geometry_msgs/TransformStamped[] transforms', 'tf2_msgs/msg/TFMessage'))


# ---- the recording ----

def read_pcd(file):
    """x, y, z, (N, 3) of float32."""
    head, body = re.match(rb'(.*?DATA binary\n)(.*)', file.read_bytes(), re.S).groups()
    fields = dict(line.split(b' ', 1) for line in head.splitlines() if not line.startswith(b'#'))
    assert fields[b'FIELDS'].startswith(b'x y z') and fields[b'TYPE'].startswith(b'F F F')
    rows = np.frombuffer(body, np.uint8).reshape(int(fields[b'POINTS']), -1)
    return rows[:, :12].copy().view('<f4')


class Recording:
    def __init__(self, folder):
        rows = np.loadtxt(folder / 'poses.txt', ndmin=2)
        stamps = rows[:, 0] if rows.shape[1] == 8 else np.arange(len(rows)) / 30
        self.stamps = [START_NS + round(stamp * 1e9) for stamp in stamps]
        self.poses = rows[:, -7:].tolist()
        self.images = sorted(folder.glob('*.depth.png'))
        self.clouds = sorted(folder.glob('*.pcd'))
        self.size = len(self.images) + len(self.clouds)
        if self.images:
            self.K = np.loadtxt(folder / 'camera-intrinsics.txt').ravel()


# ---- messages ----

def message(store, name, stamp=0, frame='', /, **fields):
    """What is not given is 0. Names are ROS 2's; of ROS 1, letters of cameras are capital."""
    def value_of(field, kind, of):
        if field == 'header':
            time = message(store, 'builtin_interfaces/msg/Time', sec=stamp // 10**9, nanosec=stamp % 10**9)
            return message(store, of, stamp=time, frame_id=frame)
        if field.lower() in fields:
            return fields[field.lower()]
        if kind == Nodetype.NAME:
            return message(store, of)
        return np.zeros(of[1]) if kind == Nodetype.ARRAY else '' if of[0] == 'string' else 0

    return store.types[name](**{field: value_of(field, *kind) for field, kind in store.fielddefs[name][1]})


def placed(store, name, values):
    """A Pose or a Transform of seven values."""
    place, turn = (of for _, (_, of) in store.fielddefs[name][1])
    return store.types[name](message(store, place, **dict(zip('xyz', values))),
                             message(store, turn, **dict(zip('xyzw', values[3:]))))


def transforms(store, stamp, parent, children, pose):
    return message(store, 'tf2_msgs/msg/TFMessage', transforms=[
        message(store, 'geometry_msgs/msg/TransformStamped', stamp, parent, child_frame_id=child,
                transform=placed(store, 'geometry_msgs/msg/Transform', pose)) for child in children])


def camera_info(store, stamp, frame, image, K):
    return message(store, 'sensor_msgs/msg/CameraInfo', stamp, frame, height=image.shape[0], width=image.shape[1],
                   distortion_model='plumb_bob', d=np.zeros(5), k=K, r=np.eye(3).ravel(),
                   p=np.hstack([K.reshape(3, 3), np.zeros((3, 1))]).ravel())


def image_message(store, stamp, frame, image, kind):
    """image: millimetres, uint16."""
    pixels, padding = image, 0
    if kind == '32FC1':  # by float32's arithmetic, so that the map is the same to the bit
        nothing = (image == 0) | (image == 65535)
        pixels = np.where(nothing, np.float32(np.nan), image.astype(np.float32) * np.float32(1 / 1000))
    elif kind == 'big':
        pixels, padding = image.astype('>u2'), 4  # rows may be longer than their pixels
    data = np.pad(np.ascontiguousarray(pixels).view(np.uint8), ((0, 0), (0, padding)), constant_values=3)
    return message(store, 'sensor_msgs/msg/Image', stamp, frame, height=image.shape[0], width=image.shape[1],
                   is_bigendian=int(kind == 'big'), encoding=kind if kind in ('mono16', '32FC1') else '16UC1',
                   step=data.shape[1], data=data.ravel())


def compressed_image(store, stamp, frame, png, kind):
    format = 'png' if kind == 'png' else '16UC1; compressedDepth png'
    head = b'' if kind == 'png' else struct.pack('<iff', 0, 0, 0)
    return message(store, 'sensor_msgs/msg/CompressedImage', stamp, frame, format=format,
                   data=np.frombuffer(head + png, np.uint8))


def cloud(store, stamp, frame, points, kind):
    number, step, offsets = ('f8', 24, (0, 8, 16)) if kind == 'doubles' else ('f4', 12, (0, 4, 8))
    if kind in ('padded', 'organised'):
        step, offsets = 32, (4, 8, 20)  # what lies between is other fields, or nothing
    height, padding = (2, 8) if kind == 'organised' else (1, 0)
    width = len(points) // height
    rows = np.full((width * height, step), 255, np.uint8)
    for offset, values in zip(offsets, points[:len(rows)].T):
        values = values.astype(('>' if kind == 'big' else '<') + number).view(np.uint8)
        rows[:, offset:offset + int(number[1])] = values.reshape(len(rows), -1)
    data = np.pad(rows.reshape(height, -1), ((0, 0), (0, padding)), constant_values=0xee)  # longer than their points
    fields = [message(store, 'sensor_msgs/msg/PointField', name=name, offset=offset, datatype=7 + (number == 'f8'), count=1)
              for name, offset in zip('xyz', offsets)]
    if kind == 'padded':
        fields = [message(store, 'sensor_msgs/msg/PointField', name='intensity', datatype=7, count=1)] + fields[::-1]
    return message(store, 'sensor_msgs/msg/PointCloud2', stamp, frame, height=height, width=width, fields=fields,
                   point_step=step, is_bigendian=kind == 'big', row_step=data.shape[1], data=data.ravel())


TURNED = [0.0, 0.0, 0.0, -0.5, 0.5, -0.5, 0.5]  # an optical frame in its camera's body


def product(a, b):
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return [aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz]


def messages(store, recording, options):
    """(topic, stamp, message) in the order of time."""
    frame = 'camera' if recording.images else 'lidar'
    kind = options['poses']
    if kind == 'chain':
        yield '/tf_static', START_NS - 1, transforms(store, START_NS - 1, 'base', (frame, 'imu'), TURNED)
    for i, (stamp, pose) in enumerate(zip(recording.stamps[:recording.size], recording.poses)):
        if kind == 'tf':
            yield '/tf', stamp, transforms(store, stamp, 'map', [frame], pose)
        elif kind == 'chain':
            inverse = [-TURNED[3], -TURNED[4], -TURNED[5], TURNED[6]]
            yield '/tf', stamp, transforms(store, stamp, '/map', ['base'], pose[:3] + product(pose[3:], inverse))
        elif kind != 'none':
            at = placed(store, 'geometry_msgs/msg/Pose', pose)
            if kind == 'odometry':
                at = message(store, 'geometry_msgs/msg/PoseWithCovariance', pose=at)
            name = 'nav_msgs/msg/Odometry' if kind == 'odometry' else 'geometry_msgs/msg/PoseStamped'
            yield ('/odom' if kind == 'odometry' else '/pose'), stamp, message(store, name, stamp, 'map',
                                                                               child_frame_id=frame, pose=at)
        if not recording.images:
            yield '/lidar/points', stamp, cloud(store, stamp, frame, read_pcd(recording.clouds[i]), options['cloud'])
            continue
        file = recording.images[i]
        image = np.array(Image.open(file), np.uint16)
        yield '/camera/depth/camera_info', stamp, camera_info(store, stamp, frame, image, recording.K)
        if options['depth'] in ('png', 'compressedDepth'):
            yield ('/camera/depth/image/' + options['depth'], stamp,
                   compressed_image(store, stamp, frame, file.read_bytes(), options['depth']))
        else:
            yield '/camera/depth/image', stamp, image_message(store, stamp, frame, image, options['depth'])


# ---- bags ----

def write_to(writer, store, serialize, all_messages):
    """rosbags' writers, of ROS 1 and ROS 2."""
    connections = {}
    with writer:
        for topic, stamp, one in all_messages:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, one.__msgtype__, typestore=store)
            writer.write(connections[topic], stamp, serialize(one, one.__msgtype__))


def write_ros1(file, all_messages, options):
    writer = rosbag1.Writer(file)
    writer.chunk_threshold = int(options['chunk'])
    if options['packing'] != 'none':
        writer.set_compression(writer.CompressionFormat[options['packing'].upper()])
    write_to(writer, ROS1, ROS1.serialize_ros1, all_messages)


def write_db3(file, all_messages, options):
    with tempfile.TemporaryDirectory(dir=file.parent) as folder:
        write_to(rosbag2.Writer(pathlib.Path(folder) / 'a', version=8), ROS2, ROS2.serialize_cdr, all_messages)
        (pathlib.Path(folder) / 'a/a.db3').replace(file)


def write_mcap(file, all_messages, options):
    with open(file, 'wb') as out:
        chunk, packing = int(options['chunk']), mcap.writer.CompressionType[options['packing'].upper()]
        writer, channels = mcap.writer.Writer(out, chunk, packing, use_chunking=chunk > 0), {}
        writer.start('ros2')
        for topic, stamp, one in all_messages:
            if topic not in channels:
                definition, _ = ROS2.generate_msgdef(one.__msgtype__, ros_version=2)
                schema = writer.register_schema(one.__msgtype__, 'ros2msg', definition.encode())
                channels[topic] = writer.register_channel(topic, 'cdr', schema)
            writer.add_message(channels[topic], stamp, bytes(ROS2.serialize_cdr(one, one.__msgtype__)), stamp)
        writer.finish()


def write_bag(folder, file, given):
    options = {'packing': 'none', 'poses': 'tf', 'depth': '16UC1', 'cloud': 'plain', 'chunk': str(768 * 1024)}
    options.update(argument.split('=') for argument in given)
    file.unlink(missing_ok=True)
    write = {'.bag': write_ros1, '.db3': write_db3, '.mcap': write_mcap}[file.suffix]
    store = ROS1 if file.suffix == '.bag' else ROS2
    write(file, messages(store, Recording(folder), options), options)
