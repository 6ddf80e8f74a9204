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
from flysim.datasets.mcap_write import BAG, NS, ODOM, TRUE, McapWriter, rosbags
from flysim.datasets.poses import nearest, posed
from flysim.errors import FlysimError
from flysim.foreign.bag import METADATA, weigh_bag
from flysim.foreign.folder import inside
from flysim.foreign.image import MAX_PIXELS
from flysim.geometry.calibration.calibration import Calibration
from flysim.geometry.calibration.ros import ros
from flysim.geometry.camera_info import CameraInfo, camera_info_yaml
from flysim.geometry.frames import Array
from flysim.plain import shown, shown_path

SOON = 0.02  # [s] between a picture and its pose
CHANNELS = {"rgb8": 3, "bgr8": 3, "mono8": 1}


class Mcap:
    """The format `mcap`."""

    def writer(self, folder: Path, header: Header) -> Writer:
        """Who writes `bag/`."""
        return McapWriter(folder, header)

    def holds(self, folder: Path) -> bool:
        """Whether it has a bag, or is one."""
        return _bag(folder) is not None

    def read(self, folder: Path) -> Recorded:
        """The pairs of the two topics of pictures whose names say left and right."""
        bag = _bag(folder)
        assert bag is not None
        store = rosbags()
        from rosbags.rosbag2 import Reader

        weigh_bag(bag)
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
        if (path / METADATA).is_file():
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
