"""Starts `livetet track`, or connects to one that runs, and shows the organ and its targets.

What needs no Slicer is in LivetetTrackLib/session.py. OpenIGTLink is that of the extension
SlicerOpenIGTLink.
"""

import os

import ctk
import qt
import slicer
import vtk
from LivetetTrackLib.session import (
    DEFAULT_PORT,
    FRAME_TEXT,
    TARGET_REGION,
    LivetetError,
    NewestFrame,
    Session,
    find_program,
    parse_frame,
    read_scene,
)
from slicer.ScriptedLoadableModule import (
    ScriptedLoadableModule,
    ScriptedLoadableModuleLogic,
    ScriptedLoadableModuleTest,
    ScriptedLoadableModuleWidget,
)

UPDATE_MS = 100
SENSOR_RADIUS_MM = 4
TOOL_LENGTH_MM = 100


class LivetetTrack(ScriptedLoadableModule):
    """What Slicer lists."""

    def __init__(self, parent):
        ScriptedLoadableModule.__init__(self, parent)
        self.parent.title = "Livetet Track"
        self.parent.categories = ["IGT"]
        self.parent.dependencies = []
        self.parent.contributors = ["Livetet maintainers"]
        self.parent.helpText = (
            "Starts <i>livetet track</i>, or connects to one that runs: the organ follows its "
            "sensors. A radius holds the true place of a target with 95 %; '*' marks one that is "
            "too small, as sources of error are missing from it. No medical device."
        )
        self.parent.acknowledgementText = ""


class LivetetTrackWidget(ScriptedLoadableModuleWidget):
    """The panel: what is run, the targets with their radii, what is not followed."""

    def __init__(self, parent=None):
        ScriptedLoadableModuleWidget.__init__(self, parent)
        self.logic = None

    def setup(self):
        ScriptedLoadableModuleWidget.setup(self)
        self.logic = LivetetTrackLogic()
        self._add_run()
        self._add_connection()
        self._add_state()
        self.layout.addStretch(1)
        self.timer = qt.QTimer()
        self.timer.setInterval(UPDATE_MS)
        self.timer.timeout.connect(self.update)
        self.timer.start()
        self.update()

    def _section(self, title, collapsed=False):
        button = ctk.ctkCollapsibleButton()
        button.text = title
        button.collapsed = collapsed
        self.layout.addWidget(button)
        return qt.QFormLayout(button)

    def _file_choice(self, key, patterns):
        choice = ctk.ctkPathLineEdit()
        choice.filters = ctk.ctkPathLineEdit.Files
        choice.nameFilters = patterns
        choice.settingKey = "LivetetTrack/" + key
        return choice

    def _button(self, text, pressed):
        button = qt.QPushButton(text)
        button.clicked.connect(pressed)
        return button

    def _add_run(self):
        form = self._section("Run")
        self.program = self._file_choice("program", ["*"])
        self.program.toolTip = "The program livetet. Empty: that of LIVETET, or the first on PATH"
        form.addRow("Program", self.program)
        self.scene = self._file_choice("scene", ["*.yaml *.yml"])
        form.addRow("Scene", self.scene)
        self.load_button = self._button("Load image and mesh", self.on_load)
        form.addRow(self.load_button)
        self.start_button = self._button("Start", self.on_start)
        self.stop_button = self._button("Stop", self.on_stop)
        form.addRow(self.start_button)
        form.addRow(self.stop_button)

    def _add_connection(self):
        form = self._section("Connect to a run", collapsed=True)
        self.host = qt.QLineEdit("localhost")
        self.port = qt.QSpinBox()
        self.port.setRange(1, 65535)
        self.port.value = DEFAULT_PORT
        self.connect_button = self._button("Connect", self.on_connect)
        form.addRow("Host", self.host)
        form.addRow("Port", self.port)
        form.addRow(self.connect_button)

    def _add_state(self):
        form = self._section("State")
        self.state = qt.QLabel("")
        self.state.wordWrap = True
        form.addRow(self.state)
        self.table = qt.QTableWidget(0, 3)
        self.table.setHorizontalHeaderLabels(["Target", "95 % radius [mm]", "mostly of"])
        form.addRow(self.table)
        self.details = qt.QPlainTextEdit()
        self.details.readOnly = True
        form.addRow(self.details)

    def cleanup(self):
        """Called when the module is unloaded, and at Slicer's end."""
        if self.logic:
            self.timer.stop()
            self.logic.close()

    def _guarded(self, action):
        try:
            action()
        except LivetetError as error:
            slicer.util.errorDisplay(str(error))
        self.update()

    def on_load(self):
        self._guarded(lambda: self.logic.load(self.program.currentPath, self.scene.currentPath))

    def on_start(self):
        self._guarded(lambda: self.logic.start(self.program.currentPath, self.scene.currentPath))

    def on_stop(self):
        self._guarded(self.logic.stop)

    def on_connect(self):
        self._guarded(lambda: self.logic.connect(self.host.text, self.port.value))

    def update(self):
        self.logic.update()
        is_on = self.logic.is_on
        self.start_button.enabled = self.connect_button.enabled = not is_on
        self.stop_button.enabled = is_on
        self.state.text = self.logic.state_text()
        self.state.setStyleSheet("" if self.logic.is_well else "color: red")
        details = self.logic.details()
        if self.details.plainText != details:
            self.details.setPlainText(details)
        self._show_targets(self.logic.newest.frame)

    def _show_targets(self, frame):
        targets = frame.targets if frame and not self.logic.newest.is_stale else ()
        self.table.setRowCount(len(targets))
        for row, target in enumerate(targets):
            radius = f"{target.radius_95_mm:.1f}{'*' if frame.missing else ''}"
            for column, text in enumerate((target.name, radius, target.main_source())):
                self.table.setItem(row, column, qt.QTableWidgetItem(text))


class LivetetTrackLogic(ScriptedLoadableModuleLogic):
    """Nodes of the scene, by what comes: update() is called ten times a second."""

    def __init__(self):
        ScriptedLoadableModuleLogic.__init__(self)
        self.session = None
        self.connector = None
        self.newest = NewestFrame()
        self.organ = "Organ"
        self.problem = ""
        self._text_time = None
        self._targets = None
        self._shown = set()  # IDs of the nodes whose display was set

    # What the user asks for.

    def load(self, program, scene):
        """Loads the image and, if Slicer reads its format, the mesh that the scene names."""
        info = read_scene(find_program(program), scene, slicer.util.startupEnvironment())
        if not info.image and not info.model:
            raise LivetetError(
                f"{scene}: its image is in no file that Slicer loads by its name; the module "
                "DICOM loads series"
            )
        if info.image:
            load = slicer.util.loadLabelVolume if info.image_has_labels else slicer.util.loadVolume
            volume = load(info.image)
            if info.image_has_labels:
                slicer.util.setSliceViewerLayers(label=volume, fit=True)
            else:
                slicer.util.setSliceViewerLayers(background=volume, fit=True)
        if info.model:
            self._load_model(info)

    def _load_model(self, info):
        storage = slicer.vtkMRMLModelStorageNode()
        storage.SetFileName(info.model)
        system = slicer.vtkMRMLStorageNode
        storage.SetCoordinateSystem(
            system.CoordinateSystemLPS if info.model_is_lps else system.CoordinateSystemRAS
        )
        model = slicer.mrmlScene.AddNewNodeByClass(
            "vtkMRMLModelNode", os.path.basename(info.model) + " at rest"
        )
        if not storage.ReadData(model):
            slicer.mrmlScene.RemoveNode(model)
            raise LivetetError(f"{info.model}: Slicer cannot read it")
        model.CreateDefaultDisplayNodes()
        model.GetDisplayNode().SetOpacity(0.2)

    def start(self, program, scene):
        """Starts a run of the scene. update() connects to it as soon as it publishes."""
        self._refuse_second()
        environment = slicer.util.startupEnvironment()  # without Slicer's own libraries
        program = find_program(program)
        self.organ = read_scene(program, scene, environment).organ
        self._forget()
        self.session = Session(program, scene, environment=environment)

    def connect(self, host, port):
        """Connects to a run that somebody else started; waits for one that does not run yet."""
        self._refuse_second()
        self._forget()
        self.organ = "Organ"
        self._open(host, port)

    def stop(self):
        """Disconnects. A run that was started here writes its result and its report."""
        if self.session:
            self.session.stop()
        self._disconnect()

    def close(self):
        self._disconnect()
        if self.session:
            self.session.close()

    def _refuse_second(self):
        if self.is_on:
            raise LivetetError("a run is on already, expected it to be stopped first")
        if not hasattr(slicer.modules, "openigtlinkif"):
            raise LivetetError(
                "OpenIGTLinkIF is missing, expected the extension SlicerOpenIGTLink to be installed"
            )

    def _forget(self):
        self.session, self.newest, self.problem = None, NewestFrame(), ""
        node = self._text_node()  # of an earlier run
        self._text_time = node.GetMTime() if node else None

    def _open(self, host, port):
        self.connector = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLIGTLConnectorNode", "Livetet")
        self.connector.SetTypeClient(host, port)
        self.connector.Start()

    def _disconnect(self):
        if self.connector:
            self.connector.Stop()
            slicer.mrmlScene.RemoveNode(self.connector)
            self.connector = None

    # What is shown.

    @property
    def is_on(self):
        return self.connector is not None or bool(self.session and self.session.is_running)

    @property
    def is_well(self):
        frame = self.newest.frame
        if self.problem or (self.session and self.session.error):
            return False
        return not self.is_on or bool(frame and not self.newest.is_stale and not frame.troubles())

    def state_text(self):
        if self.problem:
            return self.problem
        if self.session and not self.session.is_running:
            return self.session.error or "The run has ended"
        if not self.connector:
            return "Starting, or writing the result" if self.session else "Not connected"
        if not self.newest.frame:
            return "Waiting for the first frame"
        if self.newest.is_stale:
            return f"No frame for {self.newest.age_s:.0f} s: nothing that is shown may be true"
        frame = self.newest.frame
        return "; ".join(filter(None, [*(frame.troubles() or ["Followed"]), frame.error_text()]))

    def details(self):
        if not self.session:
            return ""
        if not self.session.is_running and self.session.report:
            return self.session.report
        return "\n".join([*self.session.notes, self.session.status_line])

    def update(self):
        """Takes what came since the last call."""
        self._forget_removed()
        if self.session and not self.session.is_running:
            self._disconnect()
        elif self.session and not self.connector and not self.session.is_stopping:
            if self.session.address:
                self._open(*self.session.address)
        if self.connector:
            self._take_frame()
            self._set_displays()
        self._show_targets()

    def _forget_removed(self):
        """Of nodes that the user removed, or that went with a closed scene."""
        if self.connector and not slicer.mrmlScene.IsNodePresent(self.connector):
            self.connector.Stop()
            self.connector, self._shown = None, set()
            if self.session:
                self.session.stop()
        if self._targets and not slicer.mrmlScene.IsNodePresent(self._targets):
            self._targets = None

    def _text_node(self):
        return slicer.mrmlScene.GetFirstNode(FRAME_TEXT, "vtkMRMLTextNode")

    def _take_frame(self):
        node = self._text_node()
        if not node or node.GetMTime() == self._text_time:
            return
        self._text_time = node.GetMTime()
        try:
            self.newest.take(node.GetText())
            self.problem = ""
        except LivetetError as error:
            self.problem = str(error)

    def _set_displays(self):
        """Sets the display of each node that came for the first time."""
        for n in range(self.connector.GetNumberOfIncomingMRMLNodes()):
            node = self.connector.GetIncomingMRMLNode(n)
            if node is None or node.GetID() in self._shown:
                continue
            if node.IsA("vtkMRMLModelNode") and node.GetName() == self.organ:
                self._show_model(node, "displacement_mm", (0, 20), 0.6)
            elif node.IsA("vtkMRMLModelNode") and node.GetName() == TARGET_REGION:
                self._show_model(node, "radius_95_mm", (0, 10), 0.4)
            elif node.IsA("vtkMRMLLinearTransformNode"):
                self._show_tool(node)
            else:
                continue
            self._shown.add(node.GetID())

    def _show_model(self, model, scalar, limits, opacity):
        model.CreateDefaultDisplayNodes()
        display = model.GetDisplayNode()
        display.SetOpacity(opacity)
        display.SetVisibility2D(True)
        display.SetActiveScalar(scalar, vtk.vtkAssignAttribute.POINT_DATA)
        display.SetAndObserveColorNodeID("vtkMRMLColorTableNodeFileViridis.txt")
        display.SetScalarRangeFlag(slicer.vtkMRMLDisplayNode.UseManualScalarRange)
        display.SetScalarRange(*limits)
        display.SetScalarVisibility(True)

    def _show_tool(self, transform):
        """Puts a model under the transform: a needle for a tool with a tip, a ball for a sensor."""
        name = transform.GetName()
        if name == "TrackerToRAS":
            return
        models = slicer.modules.createmodels.logic()
        if name.endswith("TipToRAS"):
            model = models.CreateNeedle(TOOL_LENGTH_MM, 1, 0, False)
        else:
            model = models.CreateSphere(SENSOR_RADIUS_MM)
        model.SetName(name[: -len("ToRAS")] if name.endswith("ToRAS") else name)
        model.SetAndObserveTransformNodeID(transform.GetID())

    def _show_targets(self):
        """Points at the targets, labelled by their radii. Hidden while they may be wrong."""
        frame = self.newest.frame
        is_true = bool(self.connector and frame and not self.newest.is_stale and not self.problem)
        region = slicer.mrmlScene.GetFirstNode(TARGET_REGION, "vtkMRMLModelNode")
        if region and region.GetDisplayNode():
            region.GetDisplayNode().SetVisibility(is_true)
        if self._targets is None and is_true and frame.targets:
            self._targets = slicer.mrmlScene.AddNewNodeByClass(
                "vtkMRMLMarkupsFiducialNode", "LivetetTargets"
            )
            self._targets.CreateDefaultDisplayNodes()
            self._targets.SetLocked(True)
        if self._targets is None:
            return
        self._targets.GetDisplayNode().SetVisibility(is_true)
        if not is_true:
            return
        if self._targets.GetNumberOfControlPoints() != len(frame.targets):
            self._targets.RemoveAllControlPoints()
            for target in frame.targets:
                self._targets.AddControlPoint(vtk.vtkVector3d(*target.position_mm))
        for n, target in enumerate(frame.targets):
            self._targets.SetNthControlPointPosition(n, *target.position_mm)
            self._targets.SetNthControlPointLabel(n, frame.label(target))


class LivetetTrackTest(ScriptedLoadableModuleTest):
    """Run by Slicer: a frame's text is shown. The rest is tested without Slicer (tests/slicer)."""

    FRAME = (
        '{"frame": 1, "sample_time_s": 0, "latency_ms": 1, "registration": "valid", '
        '"reference": "", "sensors": {}, "statement": {"computed": 1, "missing": ["patches"], '
        '"targets": [{"name": "Vein", "position_mm": [1, 2, 3], "radius_95_mm": 2.5, '
        '"covariance_mm2": [1, 0, 0, 1, 0, 1], "rms_by_source_mm": {"sensors": 1}}]}}'
    )

    def setUp(self):
        slicer.mrmlScene.Clear()

    def runTest(self):
        self.setUp()
        logic = LivetetTrackLogic()
        logic.connector = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLIGTLConnectorNode", "Livetet")
        text = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLTextNode", FRAME_TEXT)
        text.SetText(self.FRAME)
        logic.update()
        points = slicer.mrmlScene.GetFirstNode("LivetetTargets", "vtkMRMLMarkupsFiducialNode")
        self.assertEqual(points.GetNthControlPointLabel(0), "Vein 2.5 mm*")
        self.assertEqual(logic.newest.frame, parse_frame(self.FRAME))
        logic.close()
        self.delayDisplay("A frame is shown")
