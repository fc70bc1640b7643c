"""Runs `livetet track`, and reads what it says and publishes. Needs no package, nor Slicer.

Positions are in mm, RAS, as on the wire and in Slicer.
"""

import collections
import dataclasses
import json
import math
import os
import pathlib
import re
import shutil
import signal
import subprocess
import threading
import time
from typing import Dict, List, Optional, Tuple

IMAGES = (".nii", ".nii.gz", ".nrrd", ".nhdr", ".mha", ".mhd")
MODELS = (".stl", ".obj", ".ply", ".vtk", ".vtp", ".vtu")  # surfaces and grids that Slicer shows
DEFAULT_PORT = 18945
FRAME_TEXT = "LivetetFrame"
TARGET_REGION = "TargetRegion"
STALE_S = 2.0  # frames come at least twice a second, even while no samples do


class LivetetError(RuntimeError):
    """What went wrong, in one line for the user."""


def find_program(named: str = "") -> str:
    """The program `livetet`: the named file, that of the variable LIVETET, or the first on PATH."""
    for file in (named, os.environ.get("LIVETET", "")):
        if file:
            if os.path.isfile(file) and os.access(file, os.X_OK):
                return os.path.abspath(file)
            raise LivetetError(f"{file}: is no program, expected that of livetet")
    found = shutil.which("livetet")
    if not found:
        raise LivetetError("livetet: not on PATH, expected the program's file to be named")
    return found


def _ends(path: str, endings: Tuple[str, ...]) -> bool:
    return path.lower().endswith(endings)


@dataclasses.dataclass(frozen=True)
class SceneInfo:
    """What a scene names that is loaded or expected in Slicer."""

    image: str  # a grey image or a label map; empty: none that Slicer loads by its file name
    image_has_labels: bool
    model: str  # a surface or a grid in mm that is the body at rest; empty: the scene has none
    model_is_lps: bool
    organ: str  # name of the model that comes
    transforms: Tuple[str, ...]  # names of those that come while they are seen
    has_targets: bool


def scene_info(scene: dict) -> SceneInfo:
    """Of a scene as `livetet scene FILE` prints it. Raises LivetetError for one without `track`."""
    track, mesh = scene.get("track"), scene["mesh"]
    if not track:
        raise LivetetError("the scene has no section track, expected one for `livetet track`")
    image = scene.get("image") or ""
    has_labels = not image and not mesh.get("threshold")
    image = image or mesh["file"]
    is_model = _ends(mesh["file"], MODELS) and mesh.get("unit", "mm") == "mm"
    names = ["TrackerToRAS", track["reference_tool"] + "ToRAS"]
    names += [sensor["tool"] + "ToRAS" for sensor in track.get("sensors") or []]
    names += [
        tool["tool"] + ("Tip" if tool.get("tip") else "") + "ToRAS"
        for tool in track.get("tools") or []
    ]
    return SceneInfo(
        image=image if _ends(image, IMAGES) else "",
        image_has_labels=has_labels,
        model=mesh["file"] if is_model else "",
        model_is_lps=mesh.get("space", "ras").lower() == "lps",
        organ=(track.get("publish") or {}).get("surface", "Organ"),
        transforms=tuple(dict.fromkeys(names)),
        has_targets=bool(track.get("targets")),
    )


def read_scene(program: str, scene: str, environment: Optional[Dict[str, str]] = None) -> SceneInfo:
    """Checks a scene file by the program. Raises LivetetError with the program's own line."""
    outcome = subprocess.run(
        [program, "scene", scene],
        env=environment,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        encoding="utf-8",
        errors="replace",
        check=False,
    )
    if outcome.returncode != 0:
        raise LivetetError(_last_error(outcome.stderr.splitlines(), outcome.returncode))
    return scene_info(json.loads(outcome.stdout))


def _last_error(lines, status: int) -> str:
    for line in reversed(list(lines)):
        if line.startswith("livetet: "):
            return line[len("livetet: ") :]
    if status < 0:
        return f"livetet was ended by signal {-status}"
    return f"livetet ended with status {status}"


class Session:
    """A running `livetet track`. Nothing waits for it but close()."""

    SERVES = re.compile(r"OpenIGTLink server on (\S+) port (\d+)")
    PROGRESS = re.compile(r"^\d\d:\d\d:\d\d track +(?:\d+ % )?(.*)$")
    STATUS = re.compile(r"^track: (.*\d Hz in, .*)$")

    def __init__(
        self,
        program: str,
        scene: str,
        port: int = 0,
        environment: Optional[Dict[str, str]] = None,
    ):
        """Starts it; its working folder is that of the scene. port 0: any free one."""
        self._lock = threading.Lock()
        self._address: Optional[Tuple[str, int]] = None
        self._status_line = ""
        self._notes = collections.deque(maxlen=200)
        self._report: List[str] = []
        self._asked_to_stop = False
        path = pathlib.Path(scene).absolute()
        if not path.is_file():
            raise LivetetError(f"{scene}: no such file, expected a scene (YAML)")
        try:
            self._process = subprocess.Popen(
                [program, "track", str(path), "--publish", str(port)],
                cwd=path.parent,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                encoding="utf-8",
                errors="replace",
            )
        except OSError as error:
            raise LivetetError(f"{program}: cannot be started ({error.strerror})") from error
        self._readers = [
            threading.Thread(target=self._read_messages, daemon=True),
            threading.Thread(target=self._read_report, daemon=True),
        ]
        for reader in self._readers:
            reader.start()

    def _read_messages(self):
        with self._process.stderr as lines:
            for line in lines:
                self._take_message(line.rstrip("\n"))

    def _take_message(self, line):
        progress = self.PROGRESS.match(line) or self.STATUS.match(line)
        serves = self.SERVES.search(line)
        with self._lock:
            if serves:
                self._address = (serves.group(1), int(serves.group(2)))
            if progress:
                self._status_line = progress.group(1)
            elif line:
                self._notes.append(line)

    def _read_report(self):
        with self._process.stdout as lines:
            for line in lines:
                with self._lock:
                    self._report.append(line)

    @property
    def address(self) -> Optional[Tuple[str, int]]:
        """Host and port that it publishes on; None until it does."""
        with self._lock:
            return self._address

    @property
    def status_line(self) -> str:
        """The newest status line."""
        with self._lock:
            return self._status_line

    @property
    def notes(self) -> List[str]:
        """Its other messages, the last ones last."""
        with self._lock:
            return list(self._notes)

    @property
    def report(self) -> str:
        """What it printed at its end."""
        with self._lock:
            return "".join(self._report)

    @property
    def is_running(self) -> bool:
        return self._process.poll() is None or any(r.is_alive() for r in self._readers)

    @property
    def is_stopping(self) -> bool:
        """Whether it was asked to end."""
        return self._asked_to_stop

    @property
    def exit_status(self) -> Optional[int]:
        """0: it ended well; 3: frames did not converge; None: it runs."""
        return None if self.is_running else self._process.returncode

    @property
    def error(self) -> str:
        """Why it ended, in one line; empty while it runs, and if it ended well."""
        status = self.exit_status
        if status in (None, 0) or (self._asked_to_stop and status == -signal.SIGINT):
            return ""  # asked to stop before it had begun
        if status == 3:
            return "frames did not converge, see the report"
        return _last_error(self.notes, status)

    def stop(self):
        """Asks it to end, and to write result and report, which may take seconds: is_running."""
        if self._process.poll() is None and not self._asked_to_stop:
            self._asked_to_stop = True
            self._process.send_signal(signal.SIGINT)

    def close(self, patience_s: float = 60):
        """Ends it, and waits for it; by force if it has not ended by then."""
        self.stop()
        try:
            self._process.wait(patience_s)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        for reader in self._readers:
            reader.join(patience_s)


@dataclasses.dataclass(frozen=True)
class Target:
    """Where a target is shown, and how far off that may be."""

    name: str
    position_mm: Tuple[float, float, float]
    radius_95_mm: float  # with 95 % the true place is no farther
    covariance_mm2: Tuple[float, ...]  # xx, xy, xz, yy, yz, zz
    rms_by_source_mm: Dict[str, float]

    def main_source(self) -> str:
        """The source of error with the largest share."""
        if not self.rms_by_source_mm:
            return ""
        return max(self.rms_by_source_mm, key=lambda name: self.rms_by_source_mm[name])


@dataclasses.dataclass(frozen=True)
class Sensor:
    name: str
    status: str  # placing, following, holding, ...
    reason: str  # empty: no trouble
    press_mm: float


@dataclasses.dataclass(frozen=True)
class Frame:
    """What the text `LivetetFrame` says of a frame."""

    number: int
    time_s: float
    latency_ms: float
    registration: str  # valid, held, lost
    reference: str  # why the reference sensor is not followed; empty: it is
    sensors: Tuple[Sensor, ...]
    targets: Tuple[Target, ...]
    missing: Tuple[str, ...]  # sources of error that are not in the radii, which are too small then
    computed: float  # share of the model's responses that are known, 0 to 1

    def label(self, target: Target) -> str:
        """Name and radius; '*' marks a radius that is too small, as in `livetet view`."""
        return f"{target.name} {target.radius_95_mm:.1f} mm{'*' if self.missing else ''}"

    def error_text(self) -> str:
        """The largest radius, as in the status line; empty without targets."""
        if not self.targets:
            return ""
        worst = max(self.targets, key=lambda target: target.radius_95_mm)
        text = f"error within {worst.radius_95_mm:.1f} mm ({worst.name})"
        if self.missing:
            text += f", without {', '.join(self.missing)}"
        if self.computed < 1:
            text += f" ({100 * self.computed:.0f} % computed)"
        return text

    def troubles(self) -> List[str]:
        """What is not followed, and why; empty if all is well."""
        texts = []
        if self.registration != "valid":
            because = f" ({self.reference})" if self.reference else ""
            texts.append(f"registration {self.registration}{because}")
        for sensor in self.sensors:
            if sensor.reason or sensor.status not in ("following", "placing"):
                because = f" ({sensor.reason})" if sensor.reason else ""
                texts.append(f"{sensor.name} {sensor.status}{because}")
        return texts


def _numbers(values, count: int) -> Tuple[float, ...]:
    numbers = tuple(float(value) for value in values)
    if len(numbers) != count or not all(math.isfinite(number) for number in numbers):
        raise ValueError(f"{values}: expected {count} finite numbers")
    return numbers


def _number(value) -> float:
    return _numbers((value,), 1)[0]


def _target(entry: dict) -> Target:
    radius = _number(entry["radius_95_mm"])
    if radius < 0:
        raise ValueError(f"radius_95_mm = {radius}: expected no negative number")
    return Target(
        name=str(entry["name"]),
        position_mm=_numbers(entry["position_mm"], 3),
        radius_95_mm=radius,
        covariance_mm2=_numbers(entry["covariance_mm2"], 6),
        rms_by_source_mm={k: _number(v) for k, v in entry["rms_by_source_mm"].items()},
    )


def parse_frame(text: str) -> Frame:
    """Reads the text `LivetetFrame`. Raises LivetetError if it is none."""
    try:
        frame = json.loads(text)
        statement = frame.get("statement", {})
        return Frame(
            number=int(frame["frame"]),
            time_s=_number(frame["sample_time_s"]),
            latency_ms=_number(frame["latency_ms"]),
            registration=str(frame["registration"]),
            reference=str(frame["reference"]),
            sensors=tuple(
                Sensor(name, str(s["status"]), str(s["reason"]), _number(s["press_mm"]))
                for name, s in frame["sensors"].items()
            ),
            targets=tuple(_target(entry) for entry in statement.get("targets", [])),
            missing=tuple(str(name) for name in statement.get("missing", [])),
            computed=_number(statement.get("computed", 1)),
        )
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise LivetetError(f"{FRAME_TEXT}: is no frame of livetet track ({error!r})") from error


class NewestFrame:
    """The newest frame that came, and whether it is still true. Clocks are monotonic seconds."""

    def __init__(self, clock=time.monotonic):
        self._clock = clock
        self._frame: Optional[Frame] = None
        self._came_s = 0.0

    def take(self, text: str) -> bool:
        """Takes the present text. Returns whether it is of another frame than before."""
        frame = parse_frame(text)
        if self._frame == frame:
            return False
        self._frame, self._came_s = frame, self._clock()
        return True

    @property
    def frame(self) -> Optional[Frame]:
        """None before the first one."""
        return self._frame

    @property
    def age_s(self) -> float:
        return self._clock() - self._came_s if self._frame else math.inf

    @property
    def is_stale(self) -> bool:
        """Whether what it shows may no longer be true."""
        return self.age_s > STALE_S
