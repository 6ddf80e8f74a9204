"""A bag of ROS 2 in MCAP: `bag/`, written and read by rosbags (`pip install 'flysim-testbed[mcap]'`).

Topics: `/stereo/left|right/image` (rgb8) and `camera_info`, `/odom` (believed, base_link in odom); what is true under
`/ground_truth`: `odom`, `left/depth` (32FC1 [m]), `left/instances` (16UC1, as `truth/mask_left`), `camera_info` of both
eyes, `obstacles` (markers with their dimensions); `/tf_static` has both optical frames in base_link.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flysim.datasets.layout import MAX_FRAMES, Eyes, Header, Recorded, Writer
from flysim.datasets.poses import nearest, posed
from flysim.datasets.truth_folder import mask
from flysim.errors import FlysimError
from flysim.foreign.folder import inside
from flysim.foreign.image import MAX_PIXELS
from flysim.geometry.calibration.calibration import Calibration
from flysim.geometry.calibration.ros import ros
from flysim.geometry.camera import Camera
from flysim.geometry.camera_info import CameraInfo, camera_info_yaml
from flysim.geometry.frames import Array, inverse, quaternion_xyzw
from flysim.geometry.rig import StereoRig
from flysim.plain import shown, shown_path
from flysim.products.frame import Frame
from flysim.truth.obstacles import TrueObstacle
from flysim.truth.stop import Stop

BAG = "bag"
MAX_BYTES = 2**33
EYES = ("/stereo/left", "/stereo/right")
ODOM, TRUE = "/odom", "/ground_truth"
FRAMES = ("stereo_left_optical", "stereo_right_optical")
NS = 1_000_000_000
SOON = 0.02  # [s] between a picture and its pose
CHANNELS = {"rgb8": 3, "bgr8": 3, "mono8": 1}
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


class Mcap:
    """The format `mcap`."""

    def writer(self, folder: Path, header: Header) -> Writer:
        """Who writes `bag/`."""
        return _McapWriter(folder, header)

    def holds(self, folder: Path) -> bool:
        """Whether it has a bag, or is one."""
        return _bag(folder) is not None

    def read(self, folder: Path) -> Recorded:
        """The pairs of the two topics of pictures whose names say left and right."""
        bag = _bag(folder)
        assert bag is not None
        store = rosbags()
        from rosbags.rosbag2 import Reader

        if sum(path.stat().st_size for path in bag.iterdir()) > MAX_BYTES:
            raise FlysimError(f"{shown_path(bag)}: more than {MAX_BYTES} bytes; a bag so large is not read.")
        pictures: dict[str, list[tuple[int, bytes]]] = {}
        poses: list[tuple[int, Any]] = []
        told: dict[int, bytes] = {}
        try:
            with Reader(bag) as reader:
                topics = _topics([(one.topic, one.msgtype) for one in reader.connections], bag)
                infos = {f"{topic.rpartition('/')[0]}/camera_info": side for side, topic in enumerate(topics)}
                wanted = [one for one in reader.connections if one.topic in (*topics, ODOM, *infos)]
                for connection, stamp, raw in reader.messages(wanted):
                    if connection.topic in infos:
                        told.setdefault(infos[connection.topic], bytes(raw))
                    elif connection.topic == ODOM:
                        poses.append((stamp, store.deserialize_cdr(raw, connection.msgtype)))
                    else:
                        pictures.setdefault(connection.topic, []).append((stamp, bytes(raw)))
                    if max([len(poses), *map(len, pictures.values())]) > MAX_FRAMES:
                        raise FlysimError(f"{shown_path(bag)}: more than {MAX_FRAMES} messages: not read.")
        except FlysimError:
            raise
        except Exception as error:  # a damaged bag may fail in any way
            raise FlysimError(f"{shown_path(bag)}: cannot read the bag: {type(error).__name__}: {error}.") from None
        left, right = (pictures.get(topic, []) for topic in topics)
        if not left or [stamp for stamp, _ in left] != [stamp for stamp, _ in right]:
            raise FlysimError(
                f"{shown_path(bag)}: {len(left)} pictures in {topics[0]}, {len(right)} in {topics[1]}: both eyes need "
                "the same timestamps."
            )
        stamps = [stamp for stamp, _ in left]

        def read(k: int) -> Eyes:
            return picture(store, left[k][1], bag, k), picture(store, right[k][1], bag, k)

        return Recorded(
            times=tuple((stamp - stamps[0]) / NS for stamp in stamps),
            eyes=read,
            calibration=partial(_calibration, store, told, bag, level="rect" in topics[0]) if len(told) == 2 else None,
            T_world_base=_poses(poses, stamps, bag),
        )


class _McapWriter:
    def __init__(self, folder: Path, header: Header) -> None:
        self._store, self._header = rosbags(), header
        from rosbags.rosbag2 import StoragePlugin
        from rosbags.rosbag2 import Writer as Bag

        self._bag = Bag(folder / BAG, version=9, storage_plugin=StoragePlugin.MCAP)
        self._bag.open()
        self._topics: dict[str, Any] = {}

    def add(self, number: int, frame: Frame, stop: Stop) -> None:
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


def picture(store: Any, raw: bytes, bag: Path, number: int) -> NDArray[np.uint8]:
    """`[H, W, 3]` RGB of a message.

    Raises:
        FlysimError: it is damaged, too large, or of another encoding than `CHANNELS` has.
    """
    where = f"{shown_path(bag)}: picture {number}"
    try:
        message = store.deserialize_cdr(raw, "sensor_msgs/msg/Image")
        height, width, encoding = int(message.height), int(message.width), str(message.encoding)
        channels = CHANNELS.get(encoding)
        if channels is None:
            raise FlysimError(f"{where} is encoded as {shown(encoding)}: {', '.join(CHANNELS)} are read.")
        if not 0 < width * height <= MAX_PIXELS or message.step != width * channels:
            raise FlysimError(f"{where} has {width}x{height} px and rows of {message.step} bytes.")
        image = np.asarray(message.data, np.uint8).reshape(height, width, channels)
    except FlysimError:
        raise
    except Exception as error:  # as above
        raise FlysimError(f"{where} is damaged: {type(error).__name__}: {error}.") from None
    if channels == 1:
        return np.repeat(image, 3, axis=2)
    return np.ascontiguousarray(image[..., ::-1] if encoding == "bgr8" else image)


def _calibration(store: Any, told: dict[int, bytes], bag: Path, *, level: bool) -> Calibration:
    """That of two messages; of pictures that are level already, without their lenses.

    Raises:
        FlysimError: they are none, or of no left and right eye.
    """
    texts, where = [], f"{shown_path(bag)}: camera_info"
    for side in (0, 1):
        try:
            one = store.deserialize_cdr(told[side], "sensor_msgs/msg/CameraInfo")
            info = CameraInfo(
                width=int(one.width),
                height=int(one.height),
                K=one.k.reshape(3, 3),
                model=str(one.distortion_model) or "plumb_bob",
                D=one.d,
                R=one.r.reshape(3, 3),
                P=one.p.reshape(3, 4),
            )
        except Exception as error:  # as above
            raise FlysimError(f"{where} is damaged: {type(error).__name__}: {error}.") from None
        texts.append(camera_info_yaml(info))
    found = ros((texts[0], texts[1]), (f"{where} left", f"{where} right"))
    return replace(found, lenses=None, T_right_left=None) if level else found


def _bag(folder: Path) -> Path | None:
    for path in (folder / BAG, folder):
        if (path / "metadata.yaml").is_file():
            inside(folder, str(path.relative_to(folder)))
            return path
    return None


def _topics(connections: list[tuple[str, str]], bag: Path) -> tuple[str, str]:
    """The topics of the left and the right pictures."""
    found = []
    for side in ("left", "right"):
        named = sorted(
            topic for topic, kind in connections
            if kind == "sensor_msgs/msg/Image" and side in topic and not topic.startswith(TRUE)
        )  # fmt: skip
        if not named:
            raise FlysimError(f"{shown_path(bag)}: no topic of pictures (sensor_msgs/msg/Image) is called {side}.")
        own = f"/stereo/{side}/image"
        found.append(own if own in named else named[0])
    return found[0], found[1]


def _poses(messages: list[tuple[int, Any]], stamps: list[int], bag: Path) -> tuple[Array, ...] | None:
    """base_link's, of each picture."""
    if not messages:
        return None
    when = np.array([(stamp - stamps[0]) / NS for stamp, _ in messages])
    poses = []
    for k in nearest(when, [(stamp - stamps[0]) / NS for stamp in stamps], SOON, bag):
        pose = messages[k][1].pose.pose
        place = np.array([pose.position.x, pose.position.y, pose.position.z])
        turn = np.array([getattr(pose.orientation, axis) for axis in "xyzw"])
        if not (np.isfinite(place).all() and np.isfinite(turn).all()):
            raise FlysimError(f"{shown_path(bag)}: pose {k} in {ODOM} is not finite.")
        poses.append(posed(place, turn, bag, k))
    return tuple(poses)
