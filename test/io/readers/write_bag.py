#!/usr/bin/env python3
"""Makes bags of a recording in a folder: depth images (frame-*.depth.png) or PCD files, with poses.txt
(tx ty tz qx qy qz qw, with or without a time stamp) and camera-intrinsics.txt.

Messages are of ROS 1's classes (Debian's python3-*-msgs), and rosbag writes them. For ROS 2 there is no such library
here: SQLite's by Python's sqlite3 and the schema of rosbag2, MCAP by its specification, messages by the rules of CDR
below, all of it independent of octosurf's reader. support/bag_writer.cpp speaks to it; options:

packing    none, bz2 (bag), lz4, zstd (mcap)     [none]
poses      tf, chain, odometry, pose             [tf: map → sensor; chain: map → base → sensor, sensor's axes turned]
depth      16UC1, mono16, 32FC1, big, png, compressedDepth [16UC1]
cloud      plain, doubles, padded, big, organised [plain]
scans      so many at most                       [all]
chunk      bytes of a chunk; 0: no chunks        [768 kB]
"""
import functools
import math
import os
import re
import sqlite3
import struct
import sys
import zlib

import geometry_msgs.msg as geometry
import lz4.frame
import nav_msgs.msg as nav
import rosbag
import rospy
import sensor_msgs.msg as sensor
import tf2_msgs.msg as tf
import zstandard

START_NS = 1_700_000_000_000_000_000


# ---- the recording ----

@functools.lru_cache
def read_png(file):
    """16-bit gray, as rows of bytes, big-endian."""
    data = open(file, 'rb').read()
    width, height = struct.unpack('>II', data[16:24])
    assert data[24:26] == b'\x10\0'
    position, packed = 8, b''
    while position < len(data):
        size, kind = struct.unpack('>I4s', data[position:position + 8])
        if kind == b'IDAT':
            packed += data[position + 8:position + 8 + size]
        position += 12 + size
    plain, step = zlib.decompress(packed), 2 * width
    rows, before = [], bytes(step)
    for v in range(height):
        kind, row = plain[v * (step + 1)], bytearray(plain[v * (step + 1) + 1:(v + 1) * (step + 1)])
        for i in range(step):
            left, corner, above = row[i - 2] if i >= 2 else 0, before[i - 2] if i >= 2 else 0, before[i]
            guess = left + above - corner
            nearest = min((left, above, corner), key=lambda c: abs(guess - c)) if kind == 4 else 0
            row[i] = (row[i] + (0, left, above, (left + above) // 2, nearest)[kind]) & 255
        rows.append(bytes(row))
        before = row
    return width, height, rows


def read_pcd(file):
    data = open(file, 'rb').read()
    head, body = re.match(rb'(.*?DATA binary\n)(.*)', data, re.S).groups()
    fields = dict(line.split(b' ', 1) for line in head.splitlines() if not line.startswith(b'#'))
    step = sum(int(size) for size in fields[b'SIZE'].split())
    assert fields[b'FIELDS'].startswith(b'x y z') and fields[b'TYPE'].startswith(b'F F F')
    return [struct.unpack_from('<fff', body, i * step) for i in range(int(fields[b'POINTS']))]


class Recording:
    def __init__(self, folder, most):
        self.stamps, self.poses = [], []
        for line in open(os.path.join(folder, 'poses.txt')):
            values = [float(word) for word in line.split()]
            stamp = values.pop(0) if len(values) == 8 else len(self.stamps) / 30
            self.stamps.append(START_NS + round(stamp * 1e9))
            self.poses.append(values)
        files = sorted(os.listdir(folder))
        self.images = [os.path.join(folder, f) for f in files if f.endswith('.depth.png')][:most]
        self.clouds = [os.path.join(folder, f) for f in files if f.endswith('.pcd')][:most]
        self.size = len(self.images) + len(self.clouds)
        if self.images:
            k = open(os.path.join(folder, 'camera-intrinsics.txt')).read().split()
            self.K = [float(value) for value in k]


# ---- messages, as ROS 1's classes ----

def filled(message, stamp=None, frame=None, **fields):
    if stamp is not None:
        message.header.stamp, message.header.frame_id = rospy.Time(0, stamp), frame
    for name, value in fields.items():
        setattr(message, name, value)
    return message


def placed(pose, values):
    """The seven values in a Pose or a Transform."""
    place, turn = (getattr(pose, name) for name in pose.__slots__)
    place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w = values


def transform(stamp, parent, child, pose):
    message = filled(geometry.TransformStamped(), stamp, parent, child_frame_id=child)
    placed(message.transform, pose)
    return message


def camera_info(stamp, frame, width, height, K):
    return filled(sensor.CameraInfo(), stamp, frame, height=height, width=width, distortion_model='plumb_bob', D=[0.0] * 5,
                  K=K, R=[1.0, 0, 0, 0, 1.0, 0, 0, 0, 1.0], P=K[:3] + [0.0] + K[3:6] + [0.0] + K[6:] + [0.0])


def image(stamp, frame, width, height, rows, kind):
    """rows: as in the PNG, big-endian."""
    padding = b''
    if kind == '32FC1':
        rows = [struct.pack(f'<{width}f', *map(depth, struct.unpack(f'>{width}H', row))) for row in rows]
    elif kind == 'big':
        padding = b'\1\2\3\4'  # rows may be longer than their pixels
    else:
        rows = [struct.pack(f'<{width}H', *struct.unpack(f'>{width}H', row)) for row in rows]
    data = b''.join(row + padding for row in rows)
    return filled(sensor.Image(), stamp, frame, height=height, width=width, is_bigendian=int(kind == 'big'),
                  encoding=kind if kind in ('mono16', '32FC1') else '16UC1', step=len(data) // height, data=data)


def depth(millimetres):
    """What float32 arithmetic makes of a depth in millimetres, so that the map is the same to the bit."""
    if millimetres in (0, 65535):
        return math.nan
    single = lambda value: struct.unpack('<f', struct.pack('<f', value))[0]
    return single(single(millimetres) * single(1 / 1000))


def compressed_image(stamp, frame, png, kind):
    if kind == 'png':
        return filled(sensor.CompressedImage(), stamp, frame, format='png', data=png)
    return filled(sensor.CompressedImage(), stamp, frame, format='16UC1; compressedDepth png',
                  data=struct.pack('<iff', 0, 0, 0) + png)


def cloud(stamp, frame, points, kind):
    order, number, offsets, step = '<', sensor.PointField.FLOAT32, (0, 4, 8), 12
    if kind == 'doubles':
        number, offsets, step = sensor.PointField.FLOAT64, (0, 8, 16), 24
    if kind in ('padded', 'organised'):
        offsets, step = (4, 8, 20), 32  # what lies between is other fields, or nothing
    if kind == 'big':
        order = '>'
    height = 2 if kind == 'organised' else 1
    width, padding = len(points) // height, b'\xee' * 8 if kind == 'organised' else b''
    data = b''
    for i, values in enumerate(points[:width * height]):
        point = bytearray(b'\xff' * step)
        for offset, value in zip(offsets, values):
            struct.pack_into(order + ('d' if kind == 'doubles' else 'f'), point, offset, value)
        data += point + (padding if (i + 1) % width == 0 else b'')  # rows that are longer than their points
    fields = [sensor.PointField(name, offset, number, 1) for name, offset in zip('xyz', offsets)]
    if kind == 'padded':
        fields = [sensor.PointField('intensity', 0, 7, 1)] + fields[::-1]
    return filled(sensor.PointCloud2(), stamp, frame, height=height, width=width, fields=fields, point_step=step,
                  is_bigendian=int(kind == 'big'), row_step=width * step + len(padding), data=bytes(data))


TURNED = [0.0, 0.0, 0.0, -0.5, 0.5, -0.5, 0.5]  # an optical frame in its camera's body


def product(a, b):
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return [aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz]


def messages(recording, options):
    """(topic, stamp, message) in the order of time."""
    frame = 'camera' if recording.images else 'lidar'
    kind = options['poses']
    if kind == 'chain':
        yield '/tf_static', START_NS - 1, tf.TFMessage([transform(START_NS - 1, 'base', name, TURNED)
                                                        for name in (frame, 'imu')])
    for i in range(recording.size):
        stamp, pose = recording.stamps[i], recording.poses[i]
        if kind == 'tf':
            yield '/tf', stamp, tf.TFMessage([transform(stamp, 'map', frame, pose)])
        elif kind == 'chain':
            inverse = [-TURNED[3], -TURNED[4], -TURNED[5], TURNED[6]]
            yield '/tf', stamp, tf.TFMessage([transform(stamp, '/map', 'base', pose[:3] + product(pose[3:], inverse))])
        elif kind == 'odometry':
            odometry = filled(nav.Odometry(), stamp, 'map', child_frame_id=frame)
            placed(odometry.pose.pose, pose)
            yield '/odom', stamp, odometry
        else:
            stamped = filled(geometry.PoseStamped(), stamp, 'map')
            placed(stamped.pose, pose)
            yield '/pose', stamp, stamped
        if not recording.images:
            yield '/lidar/points', stamp, cloud(stamp, frame, read_pcd(recording.clouds[i]), options['cloud'])
            continue
        width, height, rows = read_png(recording.images[i])
        yield '/camera/depth/camera_info', stamp, camera_info(stamp, frame, width, height, recording.K)
        if options['depth'] in ('png', 'compressedDepth'):
            png = open(recording.images[i], 'rb').read()
            yield '/camera/depth/image/' + options['depth'], stamp, compressed_image(stamp, frame, png, options['depth'])
        else:
            yield '/camera/depth/image', stamp, image(stamp, frame, width, height, rows, options['depth'])


# ---- CDR: little-endian, every value aligned to its size from the end of the four bytes of encapsulation ----

NUMBERS = {'uint8': 'B', 'bool': 'B', 'int32': 'i', 'uint32': 'I', 'float32': 'f', 'float64': 'd'}


def cdr(message):
    out = bytearray()

    def put(format, value):
        out.extend(b'\0' * (-len(out) % struct.calcsize(format)) + struct.pack('<' + format, value))

    def write(kind, value):
        of, _, count = kind.rstrip(']').partition('[')
        if kind.endswith(']'):
            if not count:
                put('I', len(value))
            if isinstance(value, bytes):
                out.extend(value)
            else:
                for one in value:
                    write(of, one)
        elif kind == 'string':
            put('I', len(value.encode()) + 1)
            out.extend(value.encode() + b'\0')
        elif kind == 'time':
            put('i', value.secs)
            put('I', value.nsecs)
        elif kind in NUMBERS:
            put(NUMBERS[kind], value)
        else:
            for name, type_ in zip(value.__slots__, value._slot_types):
                if name != 'seq':  # which ROS 2's headers lack
                    write(type_, getattr(value, name))

    write(message._type, message)
    return b'\0\1\0\0' + bytes(out)


def ros2_type(message):
    return message._type.replace('/', '/msg/')


def write_db3(file, all_messages, options):
    base = sqlite3.connect(file)
    base.executescript('''
        CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
        CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
          serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
        CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL,
          data BLOB NOT NULL);
        CREATE INDEX timestamp_idx ON messages (timestamp ASC);''')
    topics = {}
    for topic, stamp, message in all_messages:
        if topic not in topics:
            topics[topic] = len(topics) + 1
            base.execute('INSERT INTO topics VALUES (?,?,?,?,?)', (topics[topic], topic, ros2_type(message), 'cdr', ''))
        base.execute('INSERT INTO messages (topic_id, timestamp, data) VALUES (?,?,?)',
                     (topics[topic], stamp, cdr(message)))
    base.commit()
    base.close()


# ---- MCAP: https://mcap.dev/spec ----

def record(op, body):
    return struct.pack('<BQ', op, len(body)) + body


def text(value):
    return struct.pack('<I', len(value.encode())) + value.encode()


def pack_chunk(records, packing):
    if packing == 'zstd':
        return zstandard.ZstdCompressor().compress(records)
    if packing == 'lz4':
        return lz4.frame.compress(records)
    return records


def write_mcap(file, all_messages, options):
    packing, limit = options['packing'], int(options['chunk'])
    out = bytearray(b'\x89MCAP0\r\n' + record(1, text('ros2') + text('write_bag.py')))
    channels, records, chunks = {}, bytearray(), 0

    def end_chunk():
        nonlocal records, chunks
        if not records:
            return
        chunks += 1
        packed = pack_chunk(bytes(records), packing)
        out.extend(record(6, struct.pack('<QQQI', 0, 0, len(records), zlib.crc32(records)) +
                          text('' if packing == 'none' else packing) + struct.pack('<Q', len(packed)) + packed))
        records = bytearray()

    for number, (topic, stamp, message) in enumerate(all_messages):
        target = records if limit > 0 else out
        if topic not in channels:
            channels[topic] = len(channels) + 1
            target += record(3, struct.pack('<H', channels[topic]) + text(ros2_type(message)) + text('ros2msg') + text(''))
            target += record(4, struct.pack('<HH', channels[topic], channels[topic]) + text(topic) + text('cdr') +
                             struct.pack('<I', 0))
        target += record(5, struct.pack('<HIQQ', channels[topic], number, stamp, stamp) + cdr(message))
        if limit > 0 and len(records) > limit:
            end_chunk()
    end_chunk()
    out += record(15, struct.pack('<I', zlib.crc32(out)))
    summary = len(out)
    out += record(11, struct.pack('<QHIIIIQQI', len(all_messages), len(channels), len(channels), 0, 0, chunks,
                                  all_messages[0][1], all_messages[-1][1], 0))
    out += record(2, struct.pack('<QQI', summary, 0, 0)) + b'\x89MCAP0\r\n'
    open(file, 'wb').write(out)


# ---- ROS 1, by its own library ----

def write_ros1(file, all_messages, options):
    with rosbag.Bag(file, 'w', compression=options['packing'], chunk_threshold=int(options['chunk'])) as bag:
        for topic, stamp, message in all_messages:
            bag.write(topic, message, rospy.Time(0, stamp))


def write_bag(folder, file, given):
    options = {'packing': 'none', 'poses': 'tf', 'depth': '16UC1', 'cloud': 'plain', 'scans': '1000000',
               'chunk': str(768 * 1024)}
    options.update(argument.split('=') for argument in given)
    write = {'.bag': write_ros1, '.db3': write_db3, '.mcap': write_mcap}[os.path.splitext(file)[1]]
    write(file, list(messages(Recording(folder, int(options['scans'])), options)), options)


if __name__ == '__main__':
    # A bag for each line of standard input, FOLDER, BAG and options between tabs; answers in lines.
    print('ready', flush=True)
    for line in sys.stdin:
        folder, file, given = line.rstrip('\n').split('\t')
        try:
            write_bag(folder, file, given.split())
            print('written', flush=True)
        except Exception as error:  # the test that asked for it fails, not the others
            print(repr(error), flush=True)
