"""Writes a bag of ROS 2 in MCAP by rosbags: which topics, `mcap.py` tells."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flysim.datasets.layout import Header
from flysim.datasets.truth_folder import mask
from flysim.errors import FlysimError
from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array, inverse, quaternion_xyzw
from flysim.geometry.rig import StereoRig
from flysim.products.frame import Frame
from flysim.truth.obstacles import TrueObstacle
from flysim.truth.stop import Stop

BAG = "bag"
EYES = ("/stereo/left", "/stereo/right")
ODOM, TRUE = "/odom", "/ground_truth"
FRAMES = ("stereo_left_optical", "stereo_right_optical")
NS = 1_000_000_000
MARKERS = {"cylinder": 3, "sphere": 2}  # all else is a cube


def rosbags() -> Any:
    """The messages of ROS 2, by rosbags.

    Raises:
        FlysimError: it is not installed.
    """
    try:
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise FlysimError("mcap: rosbags is not installed. Type: pip install 'flysim-testbed[mcap]'.") from None
    return get_typestore(Stores.ROS2_HUMBLE)


class McapWriter:
    """Writes frame after frame into `bag/`."""

    def __init__(self, folder: Path, header: Header) -> None:
        """Opens the bag.

        Raises:
            FlysimError: rosbags is not installed.
        """
        self._store, self._header = rosbags(), header
        from rosbags.rosbag2 import StoragePlugin
        from rosbags.rosbag2 import Writer as Bag

        self._bag = Bag(folder / BAG, version=9, storage_plugin=StoragePlugin.MCAP)
        self._bag.open()
        self._topics: dict[str, Any] = {}

    def add(self, number: int, frame: Frame, stop: Stop) -> None:
        """Writes what was taken and believed, and what truly was."""
        stamp, true = round(frame.time * NS), self._header.true
        if number == 0:
            self._static(stamp)
        eyes = (frame.pair.left, frame.pair.right)
        for topic, image, name in zip(EYES, eyes, FRAMES, strict=True):
            self._picture(f"{topic}/image", stamp, name, "rgb8", image)
        for prefix, rig in (("/stereo", self._header.believed), (f"{TRUE}", true)):
            for side, name in zip(("left", "right"), FRAMES, strict=True):
                self._info(f"{prefix}/{side}/camera_info", stamp, name, rig, right=side == "right")
        view = stop.views[0]
        self._picture(f"{TRUE}/left/depth", stamp, FRAMES[0], "32FC1", view.depth)
        self._picture(f"{TRUE}/left/instances", stamp, FRAMES[0], "16UC1", mask(view))
        self._odometry(ODOM, stamp, "odom", frame.T_world_base)
        self._odometry(f"{TRUE}/odom", stamp, "world", stop.T_world_base)

    def add_obstacles(self, time: float, obstacles: tuple[TrueObstacle, ...]) -> None:
        """The obstacles of the frame that was added last, as markers."""
        stamp = round(time * NS)
        marks = [self._marker(stamp, k, one) for k, one in enumerate(obstacles)]
        self._write(f"{TRUE}/obstacles", stamp, self._new("visualization_msgs/msg/MarkerArray", markers=marks))

    def finish(self) -> None:
        """Closes the bag."""
        self._bag.close()

    def _new(self, kind: str, **fields: Any) -> Any:
        return self._store.types[kind](**fields)

    def _write(self, topic: str, stamp: int, message: Any) -> None:
        kind = message.__msgtype__
        if topic not in self._topics:
            self._topics[topic] = self._bag.add_connection(topic, kind, typestore=self._store)
        self._bag.write(self._topics[topic], stamp, self._store.serialize_cdr(message, kind))

    def _head(self, stamp: int, frame: str) -> Any:
        time = self._new("builtin_interfaces/msg/Time", sec=stamp // NS, nanosec=stamp % NS)
        return self._new("std_msgs/msg/Header", stamp=time, frame_id=frame)

    def _picture(self, topic: str, stamp: int, frame: str, encoding: str, image: NDArray[Any]) -> None:
        data = np.ascontiguousarray(image).view(np.uint8).ravel()
        height, width = image.shape[:2]
        fields = {"height": height, "width": width, "encoding": encoding, "is_bigendian": 0}
        head, step = self._head(stamp, frame), len(data) // height
        self._write(topic, stamp, self._new("sensor_msgs/msg/Image", header=head, step=step, data=data, **fields))

    def _info(self, topic: str, stamp: int, frame: str, rig: StereoRig, *, right: bool) -> None:
        camera: Camera = rig.right if right else rig.left
        P = camera.K @ (rig.T_right_left[:3] if right else np.eye(4)[:3])
        region = {"x_offset": 0, "y_offset": 0, "height": 0, "width": 0, "do_rectify": False}
        message = self._new(
            "sensor_msgs/msg/CameraInfo",
            header=self._head(stamp, frame),
            **{"height": camera.height, "width": camera.width, "distortion_model": "plumb_bob", "d": np.zeros(5)},
            **{"k": camera.K.ravel(), "r": np.eye(3).ravel(), "p": P.ravel(), "binning_x": 0, "binning_y": 0},
            roi=self._new("sensor_msgs/msg/RegionOfInterest", **region),
        )
        self._write(topic, stamp, message)

    def _point(self, values: Any, kind: str = "geometry_msgs/msg/Point") -> Any:
        x, y, z = map(float, values)
        return self._new(kind, x=x, y=y, z=z)

    def _pose(self, T: Array) -> Any:
        x, y, z, w = map(float, quaternion_xyzw(T[:3, :3]))
        turn = self._new("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)
        return self._new("geometry_msgs/msg/Pose", position=self._point(T[:3, 3]), orientation=turn)

    def _odometry(self, topic: str, stamp: int, frame: str, T: Array) -> None:
        none = np.zeros(36)
        still = self._point(np.zeros(3), "geometry_msgs/msg/Vector3")
        twist = self._new("geometry_msgs/msg/Twist", linear=still, angular=still)
        message = self._new(
            "nav_msgs/msg/Odometry",
            header=self._head(stamp, frame),
            child_frame_id="base_link",
            pose=self._new("geometry_msgs/msg/PoseWithCovariance", pose=self._pose(T), covariance=none),
            twist=self._new("geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=none),
        )
        self._write(topic, stamp, message)

    def _static(self, stamp: int) -> None:
        T_base_left = self._header.T_base_left
        poses = (T_base_left, T_base_left @ inverse(self._header.believed.T_right_left))
        transforms = []
        for name, T in zip(FRAMES, poses, strict=True):
            pose, shift = self._pose(T), self._point(T[:3, 3], "geometry_msgs/msg/Vector3")
            moved = self._new("geometry_msgs/msg/Transform", translation=shift, rotation=pose.orientation)
            head = self._head(stamp, "base_link")
            transforms.append(
                self._new("geometry_msgs/msg/TransformStamped", header=head, child_frame_id=name, transform=moved)
            )
        self._write("/tf_static", stamp, self._new("tf2_msgs/msg/TFMessage", transforms=transforms))

    def _marker(self, stamp: int, number: int, one: TrueObstacle) -> Any:
        T = np.eye(4)
        c, s = np.cos(one.yaw), np.sin(one.yaw)
        T[:2, :2], T[:3, 3] = [[c, -s], [s, c]], one.center
        blank = {"format": "", "data": np.zeros(0, np.uint8)}
        return self._new(
            "visualization_msgs/msg/Marker",
            header=self._head(stamp, "world"),
            **{"ns": "obstacles", "id": number, "type": MARKERS.get(one.shape, 1), "action": 0},
            **{"pose": self._pose(T), "scale": self._point(one.size, "geometry_msgs/msg/Vector3")},
            color=self._new("std_msgs/msg/ColorRGBA", r=0.2, g=0.6, b=0.9, a=0.6 if one.visible else 0.2),
            lifetime=self._new("builtin_interfaces/msg/Duration", sec=0, nanosec=0),
            **{"frame_locked": False, "points": [], "colors": [], "texture_resource": "", "uv_coordinates": []},
            texture=self._new("sensor_msgs/msg/CompressedImage", header=self._head(0, ""), **blank),
            **{"text": one.name, "mesh_resource": "", "mesh_use_embedded_materials": False},
            mesh_file=self._new("visualization_msgs/msg/MeshFile", filename="", data=np.zeros(0, np.uint8)),
        )
