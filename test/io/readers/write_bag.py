#!/usr/bin/env python3
"""Makes bags of a recording in a folder: depth images (frame-*.depth.png) or PCD files, with poses.txt
(tx ty tz qx qy qz qw, with or without a time stamp) and camera-intrinsics.txt.

ROS 1 bags are written by rosbag, with the messages' classes of Debian's python3-*-msgs. For ROS 2 there is no such
library here: SQLite's by Python's sqlite3 and the schema of rosbag2, MCAP by its specification, messages by the
rules of CDR below, all of it independent of octosurf's reader.

  write_bag.py FOLDER BAG [key=value …]
  write_bag.py --serve

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
import struct
import sys
import zlib

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


# ---- messages, as nested lists of (type, value) in the order of their definitions ----

def header(stamp, frame):
    return [('time', stamp), ('string', frame)]


def vector(values):
    return [('f64', value) for value in values]


def transform(stamp, parent, child, pose):
    return header(stamp, parent) + [('string', child)] + vector(pose)


def tf_message(transforms):
    return [('u32', len(transforms))] + [field for one in transforms for field in one]


def odometry(stamp, parent, child, pose):
    return header(stamp, parent) + [('string', child)] + vector(pose) + vector([0.0] * (36 + 6 + 36))


def camera_info(stamp, frame, width, height, K):
    P = K[:3] + [0.0] + K[3:6] + [0.0] + K[6:] + [0.0]
    return header(stamp, frame) + [('u32', height), ('u32', width), ('string', 'plumb_bob'), ('u32', 5)] + \
        vector([0.0] * 5 + K + [1.0, 0, 0, 0, 1.0, 0, 0, 0, 1.0] + P) + \
        [('u32', 0)] * 2 + [('u32', 0)] * 4 + [('u8', 0)]


def image(stamp, frame, width, height, rows, kind):
    """rows: as in the PNG, big-endian."""
    encoding = kind if kind in ('mono16', '32FC1') else '16UC1'
    padding = b''
    if kind == '32FC1':
        rows = [b''.join(struct.pack('<f', depth(value)) for value in struct.unpack(f'>{width}H', row))
                for row in rows]
    elif kind == 'big':
        padding = b'\1\2\3\4'  # rows may be longer than their pixels
    else:
        rows = [swapped(row) for row in rows]
    data = b''.join(row + padding for row in rows)
    return header(stamp, frame) + [('u32', height), ('u32', width), ('string', encoding),
                                   ('u8', 1 if kind == 'big' else 0), ('u32', len(data) // height),
                                   ('bytes', data)]


def swapped(row):
    out = bytearray(row)
    out[0::2], out[1::2] = row[1::2], row[0::2]
    return bytes(out)


def depth(millimetres):
    """What float32 arithmetic makes of a depth in millimetres, so that the map is the same to the bit."""
    if millimetres in (0, 65535):
        return math.nan
    single = lambda value: struct.unpack('<f', struct.pack('<f', value))[0]
    return single(single(millimetres) * single(1 / 1000))


def compressed_image(stamp, frame, png, kind):
    if kind == 'png':
        return header(stamp, frame) + [('string', 'png'), ('bytes', png)]
    return header(stamp, frame) + [('string', '16UC1; compressedDepth png'),
                                   ('bytes', struct.pack('<iff', 0, 0, 0) + png)]


def cloud(stamp, frame, points, kind):
    order, real, number, offsets, step = '<', 'f', 7, (0, 4, 8), 12
    if kind == 'doubles':
        real, number, offsets, step = 'd', 8, (0, 8, 16), 24
    if kind in ('padded', 'organised'):
        offsets, step = (4, 8, 20), 32  # what lies between is other fields, or nothing
    if kind == 'big':
        order = '>'
    data = bytearray()
    for x, y, z in points:
        point = bytearray(b'\xff' * step)
        for offset, value in zip(offsets, (x, y, z)):
            struct.pack_into(order + real, point, offset, value)
        data += point
    width, height, row_step = len(points), 1, len(data)
    if kind == 'organised':  # in rows that are longer than their points
        height = 2
        width, rest = divmod(len(points), height)
        assert rest == 0
        rows = [bytes(data[i * width * step:(i + 1) * width * step]) for i in range(height)]
        data, row_step = b''.join(row + b'\xee' * 8 for row in rows), width * step + 8
    fields = [('string', 'intensity'), ('u32', 0), ('u8', 7), ('u32', 1)] if kind == 'padded' else []
    for name, offset in zip('zyx' if kind == 'padded' else 'xyz',
                            offsets[::-1] if kind == 'padded' else offsets):
        fields += [('string', name), ('u32', offset), ('u8', number), ('u32', 1)]
    return header(stamp, frame) + [('u32', height), ('u32', width), ('u32', len(fields) // 4)] + fields + \
        [('u8', 1 if kind == 'big' else 0), ('u32', step), ('u32', row_step), ('bytes', bytes(data)), ('u8', 0)]


TURNED = [0.0, 0.0, 0.0, -0.5, 0.5, -0.5, 0.5]  # an optical frame in its camera's body


def product(a, b):
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return [aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz]


def messages(recording, options):
    """(topic, type, stamp, fields) in the order of time."""
    frame = 'camera' if recording.images else 'lidar'
    kind = options['poses']
    out = []
    if kind == 'chain':
        out.append(('/tf_static', 'tf2_msgs/TFMessage', START_NS - 1,
                    tf_message([transform(START_NS - 1, 'base', frame, TURNED),
                                transform(START_NS - 1, 'base', 'imu', TURNED)])))
    for i in range(recording.size):
        stamp, pose = recording.stamps[i], recording.poses[i]
        if kind == 'tf':
            out.append(('/tf', 'tf2_msgs/TFMessage', stamp, tf_message([transform(stamp, 'map', frame, pose)])))
        elif kind == 'chain':
            inverse = [-TURNED[3], -TURNED[4], -TURNED[5], TURNED[6]]
            out.append(('/tf', 'tf2_msgs/TFMessage', stamp, tf_message([
                transform(stamp, '/map', 'base', pose[:3] + product(pose[3:], inverse))])))
        elif kind == 'odometry':
            out.append(('/odom', 'nav_msgs/Odometry', stamp, odometry(stamp, 'map', frame, pose)))
        else:
            out.append(('/pose', 'geometry_msgs/PoseStamped', stamp, header(stamp, 'map') + vector(pose)))
        if recording.images:
            width, height, rows = read_png(recording.images[i])
            out.append(('/camera/depth/camera_info', 'sensor_msgs/CameraInfo', stamp,
                        camera_info(stamp, frame, width, height, recording.K)))
            if options['depth'] in ('png', 'compressedDepth'):
                png = open(recording.images[i], 'rb').read()
                out.append(('/camera/depth/image/' + options['depth'], 'sensor_msgs/CompressedImage', stamp,
                            compressed_image(stamp, frame, png, options['depth'])))
            else:
                out.append(('/camera/depth/image', 'sensor_msgs/Image', stamp,
                            image(stamp, frame, width, height, rows, options['depth'])))
        else:
            points = read_pcd(recording.clouds[i])
            if options['cloud'] == 'organised':
                points = points[:len(points) // 2 * 2]
            out.append(('/lidar/points', 'sensor_msgs/PointCloud2', stamp,
                        cloud(stamp, frame, points, options['cloud'])))
    return out


# ---- CDR: little-endian, every value aligned to its size from the end of the four bytes of encapsulation ----

def cdr(fields):
    out = bytearray()

    def put(format, size, value):
        out.extend(b'\0' * (-len(out) % size))
        out.extend(struct.pack('<' + format, value))

    for kind, value in fields:
        if kind == 'time':
            put('i', 4, value // 10**9)
            put('I', 4, value % 10**9)
        elif kind == 'string':
            put('I', 4, len(value.encode()) + 1)
            out.extend(value.encode() + b'\0')
        elif kind == 'bytes':
            put('I', 4, len(value))
            out.extend(value)
        else:
            put(*{'u8': ('B', 1), 'u32': ('I', 4), 'f64': ('d', 8)}[kind], value)
    return b'\0\1\0\0' + bytes(out)


def ros2_type(name):
    package, message = name.split('/')
    return package + '/msg/' + message


def write_db3(file, all_messages, options):
    import sqlite3
    base = sqlite3.connect(file)
    base.executescript('''
        CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
        CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
          serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
        CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL,
          data BLOB NOT NULL);
        CREATE INDEX timestamp_idx ON messages (timestamp ASC);''')
    topics = {}
    for topic, kind, stamp, fields in all_messages:
        if topic not in topics:
            topics[topic] = len(topics) + 1
            base.execute('INSERT INTO topics VALUES (?,?,?,?,?)', (topics[topic], topic, ros2_type(kind), 'cdr', ''))
        base.execute('INSERT INTO messages (topic_id, timestamp, data) VALUES (?,?,?)',
                     (topics[topic], stamp, cdr(fields)))
    base.commit()
    base.close()


# ---- MCAP: https://mcap.dev/spec ----

def record(op, body):
    return struct.pack('<BQ', op, len(body)) + body


def text(value):
    return struct.pack('<I', len(value.encode())) + value.encode()


def pack_chunk(records, packing):
    if packing == 'zstd':
        import zstandard
        return zstandard.ZstdCompressor().compress(records)
    if packing == 'lz4':
        import lz4.frame
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

    for number, (topic, kind, stamp, fields) in enumerate(all_messages):
        target = records if limit > 0 else out
        if topic not in channels:
            channels[topic] = len(channels) + 1
            target += record(3, struct.pack('<H', channels[topic]) + text(ros2_type(kind)) + text('ros2msg') + text(''))
            target += record(4, struct.pack('<HH', channels[topic], channels[topic]) + text(topic) + text('cdr') +
                             struct.pack('<I', 0))
        target += record(5, struct.pack('<HIQQ', channels[topic], number, stamp, stamp) + cdr(fields))
        if limit > 0 and len(records) > limit:
            end_chunk()
    end_chunk()
    out += record(15, struct.pack('<I', zlib.crc32(out)))
    summary = len(out)
    out += record(11, struct.pack('<QHIIIIQQI', len(all_messages), len(channels), len(channels), 0, 0, chunks,
                                  all_messages[0][2], all_messages[-1][2], 0))
    out += record(2, struct.pack('<QQI', summary, 0, 0)) + b'\x89MCAP0\r\n'
    open(file, 'wb').write(out)


# ---- ROS 1, by its own library ----

def write_ros1(file, all_messages, options):
    import rosbag
    import rospy
    classes = {}
    with rosbag.Bag(file, 'w', compression=options['packing'], chunk_threshold=int(options['chunk'])) as bag:
        for topic, kind, stamp, fields in all_messages:
            if kind not in classes:
                package, name = kind.split('/')
                classes[kind] = getattr(__import__(package + '.msg', fromlist=[name]), name)
            bag.write(topic, ros1_message(classes[kind](), fields, kind), rospy.Time(0, stamp))


def ros1_message(message, fields, kind):
    """Fills the class' own fields: rosbag serialises them, not we."""
    import rospy
    values = [value for _, value in fields]

    def take(count=1):
        taken = values[:count]
        del values[:count]
        return taken if count > 1 else taken[0]

    def fill_header(header):
        header.stamp, header.frame_id = rospy.Time(0, take()), take()

    def fill_pose(position, orientation):
        position.x, position.y, position.z = take(3)
        orientation.x, orientation.y, orientation.z, orientation.w = take(4)

    if kind == 'tf2_msgs/TFMessage':
        from geometry_msgs.msg import TransformStamped
        for _ in range(take()):
            one = TransformStamped()
            fill_header(one.header)
            one.child_frame_id = take()
            fill_pose(one.transform.translation, one.transform.rotation)
            message.transforms.append(one)
        return message
    fill_header(message.header)
    if kind == 'nav_msgs/Odometry':
        message.child_frame_id = take()
        fill_pose(message.pose.pose.position, message.pose.pose.orientation)
    elif kind == 'geometry_msgs/PoseStamped':
        fill_pose(message.pose.position, message.pose.orientation)
    elif kind == 'sensor_msgs/CameraInfo':
        message.height, message.width, message.distortion_model, size = take(4)
        message.D, message.K, message.R, message.P = take(size), take(9), take(9), take(12)
    elif kind == 'sensor_msgs/Image':
        message.height, message.width, message.encoding, message.is_bigendian, message.step, message.data = take(6)
    elif kind == 'sensor_msgs/CompressedImage':
        message.format, message.data = take(2)
    else:
        from sensor_msgs.msg import PointField
        message.height, message.width, count = take(3)
        message.fields = [PointField(*take(4)) for _ in range(count)]
        message.is_bigendian, message.point_step, message.row_step, message.data, message.is_dense = take(5)
    return message


def write_bag(folder, file, given):
    options = {'packing': 'none', 'poses': 'tf', 'depth': '16UC1', 'cloud': 'plain', 'scans': '1000000',
               'chunk': str(768 * 1024)}
    options.update(argument.split('=') for argument in given)
    write = {'.bag': write_ros1, '.db3': write_db3, '.mcap': write_mcap}[os.path.splitext(file)[1]]
    write(file, messages(Recording(folder, int(options['scans'])), options), options)


def serve():
    """A bag for each line of standard input, FOLDER, BAG and options between tabs; answers in lines."""
    import lz4.frame
    import nav_msgs.msg
    import rosbag
    import rospy
    import sensor_msgs.msg
    import tf2_msgs.msg
    import zstandard
    print('ready', flush=True)
    for line in sys.stdin:
        folder, file, given = line.rstrip('\n').split('\t')
        try:
            write_bag(folder, file, given.split())
            print('written', flush=True)
        except Exception as error:  # the test that asked for it fails, not the others
            print(repr(error), flush=True)


if __name__ == '__main__':
    if sys.argv[1:] == ['--serve']:
        serve()
    else:
        write_bag(*sys.argv[1:3], sys.argv[3:])
