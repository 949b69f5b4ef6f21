"""Maps a ROS 1 robot's clouds and saves the map at the end: ros1_node.py CLOUD_TOPIC FIXED_FRAME MAP"""
import sys

import numpy as np
import octosurf


def points_of(cloud):
    """x, y, z (float32) of a sensor_msgs/PointCloud2, shape (n, 3)."""
    offsets = {field.name: field.offset for field in cloud.fields}
    layout = np.dtype({"names": ["x", "y", "z"], "formats": [">f4" if cloud.is_bigendian else "<f4"] * 3,
                       "offsets": [offsets[axis] for axis in "xyz"], "itemsize": cloud.point_step})
    points = np.ndarray((cloud.height, cloud.width), layout, cloud.data, 0, (cloud.row_step, cloud.point_step))
    return np.stack([points[axis].ravel() for axis in "xyz"], axis=1)

def matrix_of(transform):
    """4 x 4 of a geometry_msgs/Transform."""
    t, q = transform.translation, transform.rotation
    cross = np.cross(np.eye(3), [q.x, q.y, q.z])
    rotation = np.eye(3) + 2 * q.w * cross + 2 * cross @ cross
    return np.block([[rotation, np.array([[t.x], [t.y], [t.z]])], [np.zeros(3), 1.0]])

def main(topic, fixed_frame, file):
    import rospy, sensor_msgs.msg, tf2_ros
    def insert(cloud):
        stamp = cloud.header.stamp
        try:
            pose = buffer.lookup_transform(fixed_frame, cloud.header.frame_id, stamp, rospy.Duration(0.5)).transform
            mapper.insert_points(points_of(cloud), matrix_of(pose), stamp_s=stamp.to_sec(), sensor="lidar")
        except (tf2_ros.TransformException, octosurf.Error) as error:
            rospy.logwarn("cloud left out: %s", error)
    rospy.init_node("octosurf")
    mapper, buffer = octosurf.Mapper(detection_budget=1000), tf2_ros.Buffer()
    listener = tf2_ros.TransformListener(buffer)  # fills the buffer while it lives
    rospy.Subscriber(topic, sensor_msgs.msg.PointCloud2, insert, queue_size=10, buff_size=1 << 26)
    rospy.spin()
    mapper.drain()
    octosurf.save_map(mapper.map(), file)

if __name__ == "__main__": main(*sys.argv[1:4])
