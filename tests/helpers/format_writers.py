"""One truth, written in every format that is read: what the conformance suite opens again.

Where a format has no sample that can be had, its writer follows the format's public description; none of them shares
code with a reader.
"""

import json
import sqlite3
import struct
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from avlmaps.core.camera import Pinhole
from avlmaps.recordings.conformance import Truth, example_truth

START_S = 1_700_000_000.0
HALF_TURN = np.diag([1.0, -1.0, -1.0, 1.0])
# The truth's z up to ARKit's y up.
ARKIT_FROM_TRUTH = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
SMALL = Pinhole(26.0, 26.5, 15.5, 12.5, 32, 24)


@dataclass(frozen=True)
class Written:
    """How a format is written, and what can be expected of it.

    Attributes:
        format: the format's name on the command line.
        write: writes a truth to a path and returns what to open.
        truth: makes the truth; some formats have a camera of their own.
        options: of ``conformance.check``.
        knows_up: whether the format knows gravity.
    """

    format: str
    write: Callable[[Path, Truth], Path]
    truth: Callable[[], Truth] = example_truth
    options: Any = None
    knows_up: bool = True


def quaternion(pose: np.ndarray) -> np.ndarray:
    """Return x y z w."""
    return Rotation.from_matrix(pose[:3, :3]).as_quat()


def numbers(values: Any) -> str:
    return " ".join(repr(float(value)) for value in np.ravel(values))


def picture(path: Path, rgb: np.ndarray) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(encoded(rgb, path.suffix))


def encoded(rgb: np.ndarray, suffix: str = ".jpg") -> bytes:
    options = [cv2.IMWRITE_JPEG_QUALITY, 95] if suffix == ".jpg" else []
    return cv2.imencode(suffix, rgb[..., ::-1], options)[1].tobytes()


def units(depth_m: np.ndarray, per_m: float = 1000.0) -> np.ndarray:
    return np.rint(depth_m.astype(float) * per_m).astype(np.uint16)


def depth_png(path: Path, depth_m: np.ndarray, per_m: float = 1000.0) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(cv2.imencode(".png", units(depth_m, per_m))[1].tobytes())


def shifted(camera: Pinhole) -> list[float]:
    """Return fx, fy, cx, cy as those count who place the centre of the first pixel at (0, 0)."""
    return [camera.fx, camera.fy, camera.cx - 0.5, camera.cy - 0.5]


def film(path: Path, pictures: tuple[np.ndarray, ...]) -> None:
    """Write a video that hardly loses anything."""
    import av

    path.parent.mkdir(parents=True, exist_ok=True)
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=60, options={"crf": "4", "bf": "0"})
        stream.height, stream.width = pictures[0].shape[:2]
        stream.pix_fmt = "yuv444p"
        for rgb in pictures:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(rgb, format="rgb24")))
        container.mux(stream.encode(None))


def write_folder(path: Path, truth: Truth) -> Path:
    rgb, depth = truth.rig.rgb, truth.rig.depth
    camera = {
        name: {"fx": c.fx, "fy": c.fy, "cx": c.cx, "cy": c.cy, "width": c.width, "height": c.height}
        for name, c in (("rgb", rgb), ("depth", depth))
    }
    path.mkdir(parents=True)
    described = {"schema_version": 1, "intrinsics": camera, "up_in_world": [0, 0, 1], "depth_units_per_m": 4000}
    (path / "recording.json").write_text(json.dumps(described))
    lines = ["stamp_s,tx,ty,tz,qx,qy,qz,qw"]
    for i, pose in enumerate(truth.world_from_camera):
        picture(path / f"rgb/{i:06d}.png", truth.rgb[i])
        depth_png(path / f"depth/{i:06d}.png", truth.depth_m[i], 4000)
        lines.append(numbers([truth.stamps_s[i], *pose[:3, 3], *quaternion(pose)]).replace(" ", ","))
    (path / "poses.csv").write_text("\n".join(lines) + "\n")
    return path


def write_seven_scenes(path: Path, truth: Truth) -> Path:
    path.mkdir(parents=True)
    c = truth.rig.depth
    np.savetxt(path / "camera-intrinsics.txt", [[c.fx, 0, c.cx], [0, c.fy, c.cy], [0, 0, 1]])
    for i, pose in enumerate(truth.world_from_camera):
        stem = f"frame-{round(truth.stamps_s[i] * 30):06d}"
        picture(path / f"{stem}.color.png", truth.rgb[i])
        depth_png(path / f"{stem}.depth.png", truth.depth_m[i])
        np.savetxt(path / f"{stem}.pose.txt", pose)
    return path


def write_tum(path: Path, truth: Truth) -> Path:
    lists: dict[str, list[str]] = {"rgb": [], "depth": [], "groundtruth": ["# timestamp tx ty tz qx qy qz qw"]}
    for i, pose in enumerate(truth.world_from_camera):
        stamp = f"{START_S + truth.stamps_s[i]:.6f}"
        picture(path / f"rgb/{stamp}.png", truth.rgb[i])
        depth_png(path / f"depth/{stamp}.png", truth.depth_m[i], 5000)
        for name in ("rgb", "depth"):
            lists[name].append(f"{stamp} {name}/{stamp}.png")
        lists["groundtruth"].append(f"{stamp} {numbers([*pose[:3, 3], *quaternion(pose)])}")
    for name, lines in lists.items():
        (path / f"{name}.txt").write_text("\n".join(lines) + "\n")
    return path


def write_replica(path: Path, truth: Truth) -> Path:
    fx, fy, cx, cy = shifted(truth.rig.rgb)
    camera = {"w": truth.rig.rgb.width, "h": truth.rig.rgb.height, "fx": fx, "fy": fy, "cx": cx, "cy": cy}
    for i in range(len(truth)):
        picture(path / f"results/frame{i:06d}.jpg", truth.rgb[i])
        depth_png(path / f"results/depth{i:06d}.png", truth.depth_m[i], 6553.5)
    (path / "cam_params.json").write_text(json.dumps({"camera": {**camera, "scale": 6553.5}}))
    (path / "traj.txt").write_text("".join(numbers(pose) + "\n" for pose in truth.world_from_camera))
    return path


def write_scannet(path: Path, truth: Truth) -> Path:
    for i, pose in enumerate(truth.world_from_camera):
        picture(path / f"color/{i}.jpg", truth.rgb[i])
        depth_png(path / f"depth/{i}.png", truth.depth_m[i])
        (path / "pose").mkdir(exist_ok=True)
        np.savetxt(path / f"pose/{i}.txt", pose)
    (path / "intrinsic").mkdir()
    for name, camera in (("color", truth.rig.rgb), ("depth", truth.rig.depth)):
        k = np.eye(4)
        k[0, 0], k[1, 1], k[0, 2], k[1, 2] = shifted(camera)
        np.savetxt(path / f"intrinsic/intrinsic_{name}.txt", k)
    return path


_HABITAT_FROM_WORLD = np.array([[0.0, -1, 0, 0], [0, 0, 1, 0], [-1, 0, 0, 0], [0, 0, 0, 1]])


def write_hov_sg(path: Path, truth: Truth, kind: str = "hov-sg") -> Path:
    """Poses in files: of HOV-SG 4x4 of a camera with y up, of VLMaps seven numbers of the base, in Habitat's axes."""
    (path / "pose").mkdir(parents=True)
    for i, pose in enumerate(truth.world_from_camera):
        picture(path / f"rgb/{i:06d}.png", truth.rgb[i])
        (path / "depth").mkdir(exist_ok=True)
        np.save(path / f"depth/{i:06d}.npy", truth.depth_m[i])
        habitat = _HABITAT_FROM_WORLD @ pose @ np.diag([1.0, -1.0, -1.0, 1.0])
        if kind == "vlmaps":
            base = habitat @ np.linalg.inv(np.array([[1.0, 0, 0, 0], [0, 1, 0, 1.5], [0, 0, 1, 0], [0, 0, 0, 1]]))
            text = numbers([*base[:3, 3], *quaternion(base)])
        else:
            text = numbers(habitat)
        (path / f"pose/{i:06d}.txt").write_text(text + "\n")
    c = truth.rig.rgb
    (path / "camera.json").write_text(json.dumps({"fx": c.fx, "fy": c.fy, "cx": c.cx, "cy": c.cy}))
    return path


def write_orb_slam(path: Path, truth: Truth) -> Path:
    """Associations, ORB-SLAM's trajectory in the first camera's axes, and its settings."""
    lines, trajectory = ["# associated"], list[str]()
    for i, pose in enumerate(np.linalg.inv(truth.world_from_camera[0]) @ truth.world_from_camera):
        stamp = f"{START_S + truth.stamps_s[i]:.6f}"
        picture(path / f"rgb/{stamp}.png", truth.rgb[i])
        depth_png(path / f"depth/{stamp}.png", truth.depth_m[i], 1000)
        lines.append(f"{stamp} rgb/{stamp}.png {stamp} depth/{stamp}.png")
        trajectory.append(f"{stamp} {numbers([*pose[:3, 3], *quaternion(pose)])}")
    (path / "associations.txt").write_text("\n".join(lines) + "\n")
    (path / "CameraTrajectory.txt").write_text("\n".join(trajectory) + "\n")
    settings = zip(("fx", "fy", "cx", "cy"), shifted(truth.rig.rgb), strict=True)
    body = "".join(f"Camera.{name}: {value:.6f}\n" for name, value in settings)
    (path / "RealSense.yaml").write_text(f"%YAML:1.0\n\n{body}Camera.k1: 0.0\nDepthMapFactor: 1000.0\n")
    return path


def write_rtabmap_export(path: Path, truth: Truth, by_id: bool = False) -> Path:
    """What rtabmap-export writes: poses of the base in a world with z up, and a calibration for each picture."""
    fx, fy, cx, cy = shifted(truth.rig.rgb)
    local = np.array([[0.0, 0, 1, 0.1], [-1, 0, 0, 0.02], [0, -1, 0, 0.9], [0, 0, 0, 1]])
    placed = ", ".join(map(str, local[:3].ravel()))
    calibration = (
        f"%YAML:1.0\n---\ncamera_name: walk\nimage_width: {truth.rig.rgb.width}\nimage_height: "
        f"{truth.rig.rgb.height}\ncamera_matrix:\n   rows: 3\n   cols: 3\n   data: [ {fx}, 0., {cx}, 0., "
        f"{fy}, {cy}, 0., 0., 1. ]\nlocal_transform:\n   rows: 3\n   cols: 4\n   data: [ {placed} ]\n"
    )
    (path / "rtabmap_calib").mkdir(parents=True)
    rows: list[str] = []
    for i, pose in enumerate(truth.world_from_camera @ np.linalg.inv(local)):
        stamp = f"{START_S + truth.stamps_s[i]:.6f}"
        stem = str(10 + i) if by_id else stamp
        picture(path / f"rtabmap_rgb/{stem}.jpg", truth.rgb[i])
        depth_png(path / f"rtabmap_depth/{stem}.png", truth.depth_m[i])
        (path / f"rtabmap_calib/{stem}.yaml").write_text(calibration)
        rows.append(f"{stamp} {numbers([*pose[:3, 3], *quaternion(pose)])}{f' {10 + i}' if by_id else ''}")
    (path / "rtabmap_poses.txt").write_text("#timestamp x y z qx qy qz qw\n" + "\n".join(rows) + "\n")
    return path


def write_scannet_resized(path: Path, truth: Truth) -> Path:
    """Colour resized after the export, as many do, with the intrinsics of its first size."""
    write_scannet(path, truth)
    k = np.eye(4)
    whole = truth.rig.rgb.resized(1296, 968)
    k[0, 0], k[1, 1], k[0, 2], k[1, 2] = shifted(whole)
    np.savetxt(path / "intrinsic/intrinsic_color.txt", k)
    return path


def write_avlmaps(path: Path, truth: Truth) -> Path:
    habitat_from_truth = np.array([[0, -1.0, 0, 0], [0, 0, 1, 0], [-1, 0, 0, 0], [0, 0, 0, 1]])
    c, lines = truth.rig.rgb, []
    (path / "depth").mkdir(parents=True)
    for i, pose in enumerate(truth.world_from_camera):
        picture(path / f"rgb/{i:06d}.png", truth.rgb[i])
        np.save(path / f"depth/{i:06d}.npy", truth.depth_m[i])
        own = habitat_from_truth @ pose
        lines.append(numbers([*own[:3, 3], *quaternion(own)]))
    (path / "poses.txt").write_text("\n".join(lines) + "\n")
    described = {"pose_type": "camera_base", "fx": c.fx, "fy": c.fy, "cx": c.cx, "cy": c.cy, "rate_hz": 10}
    (path / "camera.json").write_text(json.dumps(described))
    return path


def write_stray_scanner(path: Path, truth: Truth) -> Path:
    film(path / "rgb.mp4", truth.rgb)
    c = truth.rig.rgb
    np.savetxt(path / "camera_matrix.csv", [[c.fx, 0, c.cx], [0, c.fy, c.cy], [0, 0, 1]], delimiter=", ")
    lines = ["timestamp, frame, x, y, z, qx, qy, qz, qw"]
    for i, pose in enumerate(truth.world_from_camera):
        own = ARKIT_FROM_TRUTH @ pose
        depth_m = np.where(truth.depth_m[i] > 0, truth.depth_m[i], 9.0)  # what is not sure is there as well
        depth_png(path / f"depth/{i:06d}.png", depth_m)
        (path / "confidence").mkdir(exist_ok=True)
        cv2.imwrite(str(path / f"confidence/{i:06d}.png"), np.where(truth.depth_m[i] > 0, 2, 0).astype(np.uint8))
        row = [81.5 + truth.stamps_s[i], *own[:3, 3], *quaternion(own)]
        stamp, *rest = (f"{value:.9f}" for value in row)
        lines.append(", ".join([stamp, f"{i:06d}", *rest]))
    (path / "odometry.csv").write_text("\n".join(lines) + "\n")
    return path


def write_nerfstudio(path: Path, truth: Truth) -> Path:
    c, frames = truth.rig.rgb, []
    for i, pose in enumerate(truth.world_from_camera):
        picture(path / f"images/frame_{i:05d}.png", truth.rgb[i])
        depth_png(path / f"depth/frame_{i:05d}.png", truth.depth_m[i])
        frames.append({
            "file_path": f"./images/frame_{i:05d}.png",
            "depth_file_path": f"./depth/frame_{i:05d}.png",
            "transform_matrix": (pose @ HALF_TURN).tolist(),
        })  # fmt: skip
    camera = {"fl_x": c.fx, "fl_y": c.fy, "cx": c.cx, "cy": c.cy, "w": c.width, "h": c.height, "k1": 0.0}
    (path / "transforms.json").write_text(json.dumps({"camera_model": "OPENCV", **camera, "frames": frames}))
    return path


def write_polycam(path: Path, truth: Truth) -> Path:
    c = truth.rig.rgb
    for i, pose in enumerate(truth.world_from_camera):
        stem = f"{41_000_000_000 + round(truth.stamps_s[i] * 1e6)}"
        picture(path / f"keyframes/images/{stem}.jpg", truth.rgb[i])
        depth_png(path / f"keyframes/depth/{stem}.png", truth.depth_m[i])
        own = ARKIT_FROM_TRUTH @ pose @ HALF_TURN
        matrix = {f"t_{row}{column}": own[row, column] for row in range(3) for column in range(4)}
        camera = {"fx": c.fx, "fy": c.fy, "cx": c.cx, "cy": c.cy, "width": c.width, "height": c.height}
        (path / "keyframes/cameras").mkdir(exist_ok=True)
        (path / f"keyframes/cameras/{stem}.json").write_text(json.dumps({**camera, **matrix, "blur_score": 100.0}))
    return path


def write_redwood(path: Path, truth: Truth) -> Path:
    fx, fy, cx, cy = shifted(truth.rig.rgb)
    lines: list[str] = []
    for i, pose in enumerate(truth.world_from_camera):
        stamp = f"{i + 1:05d}-{round(truth.stamps_s[i] * 1e6):012d}"
        picture(path / f"color/{stamp}.jpg", truth.rgb[i])
        depth_png(path / f"depth/{stamp}.png", truth.depth_m[i])
        lines += [f"{i} {i} {i + 1}", *(numbers(row) for row in pose)]
    (path / "trajectory.log").write_text("\n".join(lines) + "\n")
    matrix = [fx, 0, 0, 0, fy, 0, cx, cy, 1]
    size = {"width": truth.rig.rgb.width, "height": truth.rig.rgb.height}
    (path / "intrinsic.json").write_text(json.dumps({**size, "intrinsic_matrix": matrix}))
    return path


def icl_truth() -> Truth:
    """Return the truth as ICL-NUIM's own camera sees it, at a tenth of its size."""
    return example_truth(Pinhole(481.20, 480.0, 320.0, 240.0, 640, 480).resized(64, 48), rate_hz=30.0)


def write_icl_nuim(path: Path, truth: Truth) -> Path:
    """Write poses as ICL-NUIM has them: a left-handed world and camera, both with y up."""
    mirror = np.diag([1.0, -1.0, 1.0, 1.0])
    y_down_from_truth = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
    associations, poses = [], []
    for i, pose in enumerate(truth.world_from_camera, start=1):
        picture(path / f"rgb/{i}.png", truth.rgb[i - 1])
        depth_png(path / f"depth/{i}.png", truth.depth_m[i - 1], 5000)
        own = mirror @ y_down_from_truth @ pose @ mirror
        associations.append(f"{i} depth/{i}.png {i} rgb/{i}.png")
        poses.append(f"{i} {numbers([*own[:3, 3], *quaternion(own)])}")
    (path / "associations.txt").write_text("\n".join(associations) + "\n")
    (path / "livingRoom0.gt.freiburg").write_text("\n".join(poses) + "\n")
    return path


def write_r3d(path: Path, truth: Truth) -> Path:
    """Write a ``.r3d`` whose LZFSE streams are of plain blocks, which every reader has to know."""
    path = path.with_suffix(".r3d")
    path.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("metadata", json.dumps(record3d_metadata(truth)))
        for i in range(len(truth)):
            archive.writestr(f"rgbd/{i}.jpg", encoded(truth.rgb[i]))
            depth_m = np.where(truth.depth_m[i] > 0, truth.depth_m[i], np.float32(9.0))
            archive.writestr(f"rgbd/{i}.depth", plain_lzfse(depth_m.astype("<f4").tobytes()))
            archive.writestr(f"rgbd/{i}.conf", plain_lzfse(np.where(truth.depth_m[i] > 0, 2, 0).astype("u1").tobytes()))
    return path


def plain_lzfse(content: bytes) -> bytes:
    half = len(content) // 2
    blocks = (content[:half], content[half:])
    return b"".join(b"bvx-" + struct.pack("<I", len(block)) + block for block in blocks) + b"bvx$"


def record3d_metadata(truth: Truth) -> dict[str, Any]:
    c, d = truth.rig.rgb, truth.rig.depth
    own = ARKIT_FROM_TRUTH @ truth.world_from_camera @ HALF_TURN
    return {
        "w": c.width, "h": c.height, "dw": d.width, "dh": d.height, "fps": 60,
        "K": [c.fx, 0, 0, 0, c.fy, 0, c.cx, c.cy, 1],
        "initPose": [0, 0, 0, 1, 0, 0, 0],
        "poses": [[*map(float, quaternion(pose)), *map(float, pose[:3, 3])] for pose in own],
        "frameTimestamps": [float(stamp) + 3.25 for stamp in truth.stamps_s],
    }  # fmt: skip


def write_record3d_exr(path: Path, truth: Truth) -> Path:
    inside = path / "EXR_RGBD"
    (inside / "depth").mkdir(parents=True)
    for i in range(len(truth)):
        picture(inside / f"rgb/{i}.jpg", truth.rgb[i])
        (inside / f"depth/{i}.exr").write_bytes(exr(truth.depth_m[i], "R", packed=i % 2 == 0))
    (inside / "metadata.json").write_text(json.dumps(record3d_metadata(truth)))
    return path


def exr(depth_m: np.ndarray, channel: str, packed: bool) -> bytes:
    """Write floats in scan lines, plain or in ZIP blocks of 16 lines."""
    height, width = depth_m.shape
    box = struct.pack("<4i", 0, 0, width - 1, height - 1)
    listed = channel.encode() + b"\0" + struct.pack("<iIii", 2, 0, 1, 1) + b"\0"
    header = b"".join(
        name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<I", len(value)) + value
        for name, kind, value in (
            ("channels", "chlist", listed),
            ("compression", "compression", b"\x03" if packed else b"\x00"),
            ("dataWindow", "box2i", box),
            ("displayWindow", "box2i", box),
            ("lineOrder", "lineOrder", b"\0"),
            ("pixelAspectRatio", "float", struct.pack("<f", 1.0)),
            ("screenWindowCenter", "v2f", struct.pack("<2f", 0.0, 0.0)),
            ("screenWindowWidth", "float", struct.pack("<f", 1.0)),
        )
    )
    start = struct.pack("<II", 20000630, 2) + header + b"\0"
    lines = 16 if packed else 1
    chunks = [
        struct.pack("<iI", y, len(raw)) + raw
        for y in range(0, height, lines)
        for raw in [_exr_block(depth_m[y : y + lines].astype("<f4").tobytes(), packed)]
    ]
    at = len(start) + 8 * len(chunks)
    offsets = [at + sum(map(len, chunks[:i])) for i in range(len(chunks))]
    return start + struct.pack(f"<{len(offsets)}Q", *offsets) + b"".join(chunks)


def _exr_block(raw: bytes, packed: bool) -> bytes:
    if not packed:
        return raw
    halves = np.frombuffer(raw[::2] + raw[1::2], np.uint8).astype(np.int64)
    steps = np.diff(halves, prepend=0) + np.where(np.arange(len(halves)) > 0, 128, 0)
    return zlib.compress((steps % 256).astype(np.uint8).tobytes())


def write_rtabmap(path: Path, truth: Truth, depth: str = "png", optimised: bool = True) -> Path:
    """Write a database; odometry drifts away from the optimised poses, which are right."""
    path = path.with_suffix(".db")
    path.parent.mkdir(parents=True, exist_ok=True)
    fx, fy, cx, cy = shifted(truth.rig.rgb)
    base_from_camera = np.array([[0.0, 0, 1, 0.1], [-1, 0, 0, 0.02], [0, -1, 0, 0.9], [0, 0, 0, 1]])
    world_from_base = truth.world_from_camera @ np.linalg.inv(base_from_camera)
    head = (0, 21, 4, 0, truth.rig.rgb.width, truth.rig.rgb.height, 9, 5, 9, 12, 12)
    k, p = [fx, 0, cx, 0, fy, cy, 0, 0, 1], [fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0]
    matrices = struct.pack("<35d", *k, *[0] * 5, *np.eye(3).ravel(), *p)
    calibration = struct.pack("<11i", *head) + matrices + base_from_camera[:3].astype("<f4").tobytes()
    with sqlite3.connect(path) as database:
        database.execute("CREATE TABLE Node (id INTEGER PRIMARY KEY, map_id INTEGER, stamp FLOAT, pose BLOB)")
        database.execute("CREATE TABLE Data (id INTEGER PRIMARY KEY, image BLOB, depth BLOB, calibration BLOB)")
        database.execute("CREATE TABLE Admin (version TEXT, opt_ids BLOB, opt_poses BLOB)")
        for i in range(len(truth)):
            pose = world_from_base[i].copy()
            pose[0, 3] += 0.05 * i if optimised else 0.0
            row = (i + 1, 0, START_S + truth.stamps_s[i], pose[:3].astype("<f4").tobytes())
            database.execute("INSERT INTO Node VALUES (?, ?, ?, ?)", row)
            stored = (i + 1, encoded(truth.rgb[i]), _rtabmap_depth(truth.depth_m[i], depth), calibration)
            database.execute("INSERT INTO Data VALUES (?, ?, ?, ?)", stored)
        ids = np.arange(1, len(truth) + 1, dtype="<i4")
        blobs = (
            (_matrix_blob(ids, 4), _matrix_blob(world_from_base[:, :3].astype("<f4"), 5)) if optimised else (None, None)
        )
        database.execute("INSERT INTO Admin VALUES ('0.21.4', ?, ?)", blobs)
    database.close()
    return path


def _matrix_blob(values: np.ndarray, kind: int) -> bytes:
    return zlib.compress(values.tobytes()) + struct.pack("<3i", 1, values.size, kind)


def _rtabmap_depth(depth_m: np.ndarray, kind: str) -> bytes:
    if kind == "rvl":
        return b"DEPTHRVL" + struct.pack("<II", depth_m.shape[1], depth_m.shape[0]) + rvl(units(depth_m))
    pixels = (
        units(depth_m) if kind == "png" else np.ascontiguousarray(depth_m).view(np.uint8).reshape(*depth_m.shape, 4)
    )
    return cv2.imencode(".png", pixels)[1].tobytes()


def rvl(depth: np.ndarray) -> bytes:
    """Write RVL by its paper: runs of zeros and of depths; differences in groups of three bits."""
    groups: list[int] = []

    def put(value: int) -> None:
        while True:
            groups.append(value & 7 | (8 if value > 7 else 0))
            value >>= 3
            if not value:
                return

    flat, at, before = depth.ravel().astype(int).tolist(), 0, 0
    while at < len(flat):
        zeros = next((i for i in range(at, len(flat)) if flat[i]), len(flat)) - at
        depths = next((i for i in range(at + zeros, len(flat)) if not flat[i]), len(flat)) - at - zeros
        put(zeros)
        put(depths)
        for value in flat[at + zeros : at + zeros + depths]:
            step, before = value - before, value
            put(step << 1 if step >= 0 else (-step << 1) - 1)
        at += zeros + depths
    groups += [0] * (-len(groups) % 8)
    words = [int("".join(f"{group:x}" for group in groups[i : i + 8]), 16) for i in range(0, len(groups), 8)]
    return struct.pack(f"<{len(words)}I", *words)


def _sized() -> Truth:
    """Return a truth whose depth has half the size of its colour."""
    return example_truth(SMALL.resized(64, 48), SMALL)


def _tum_truth() -> Truth:
    return example_truth(Pinhole(517.3, 516.5, 319.1, 255.8, 640, 480).resized(64, 48))


WRITTEN: dict[str, Written] = {
    "folder": Written("folder", write_folder, _sized),
    "7scenes": Written("7scenes", write_seven_scenes, knows_up=False),
    "tum": Written("tum", lambda path, truth: write_tum(path.with_name("freiburg1_walk"), truth), _tum_truth),
    "replica": Written("replica", write_replica, lambda: example_truth(rate_hz=30.0)),
    "scannet": Written("scannet", write_scannet, lambda: example_truth(SMALL.resized(64, 48), SMALL, rate_hz=30.0)),
    "scannet, resized colour": Written(
        "scannet", write_scannet_resized, lambda: example_truth(SMALL.resized(64, 48), SMALL, rate_hz=30.0)
    ),
    "avlmaps": Written("avlmaps", write_avlmaps),
    "stray-scanner": Written("stray-scanner", write_stray_scanner, _sized),
    "nerfstudio": Written("nerfstudio", write_nerfstudio, options={"stamps": False}, knows_up=False),
    "polycam": Written("polycam", write_polycam, _sized),
    "redwood": Written("redwood", write_redwood, knows_up=False),
    "icl-nuim": Written("icl-nuim", write_icl_nuim, icl_truth),
    "hov-sg": Written("hov-sg", write_hov_sg, lambda: example_truth(rate_hz=30.0)),
    "hov-sg, of VLMaps": Written(
        "hov-sg", lambda path, truth: write_hov_sg(path, truth, "vlmaps"), lambda: example_truth(rate_hz=30.0)
    ),
    "orb-slam": Written("orb-slam", write_orb_slam, knows_up=False),
    "rtabmap-export": Written("rtabmap-export", write_rtabmap_export),
    "rtabmap-export, by ids": Written("rtabmap-export", lambda path, truth: write_rtabmap_export(path, truth, True)),
    "record3d": Written("record3d", write_r3d, _sized),
    "record3d, EXR and JPG": Written("record3d", write_record3d_exr, _sized),
    "rtabmap": Written("rtabmap", write_rtabmap),
    "rtabmap, RVL": Written("rtabmap", lambda path, truth: write_rtabmap(path, truth, "rvl")),
    "rtabmap, floats and odometry": Written(
        "rtabmap", lambda path, truth: write_rtabmap(path, truth, "floats", optimised=False)
    ),
}  # fmt: skip
