"""The module's own file, with stand-ins for Slicer's modules: a run is started, its messages become
nodes, and what the user would see is checked. Not Slicer itself: names that Slicer does not have
would not be found here."""

import importlib
import itertools
import sys
import time
import types
from unittest import mock

import support


def factory():
    """Stands for a class: each call makes a new object that takes every call."""
    return mock.MagicMock(side_effect=lambda *_, **__: mock.MagicMock())


class Widgets(types.ModuleType):
    """Stands for a module of widgets."""

    def __getattr__(self, name):
        setattr(self, name, factory())
        return getattr(self, name)


class Node(mock.MagicMock):
    numbers = itertools.count()

    def of(self, kind, name):
        self.kind, self.stamp = kind, 0
        self.GetName.return_value = name
        self.GetID.return_value = f"{kind}{next(self.numbers)}"
        self.IsA.side_effect = lambda other: other == kind
        self.GetMTime.side_effect = lambda: self.stamp
        return self


class Points:
    """Stands for a list of points."""

    def __init__(self):
        self.places, self.labels = [], []
        self.display = mock.MagicMock()

    def __getattr__(self, name):
        return {"GetDisplayNode": lambda: self.display}.get(name, mock.MagicMock())

    def GetNumberOfControlPoints(self):
        return len(self.places)

    def AddControlPoint(self, place):
        self.places.append(tuple(place))
        self.labels.append("")

    def SetNthControlPointPosition(self, n, *place):
        self.places[n] = place

    def SetNthControlPointLabel(self, n, label):
        self.labels[n] = label


class Connector(Node):
    """Stands for OpenIGTLinkIF: messages become nodes."""

    KINDS = {
        "POLYDATA": "vtkMRMLModelNode",
        "TRANSFORM": "vtkMRMLLinearTransformNode",
        "STRING": "vtkMRMLTextNode",
        "STATUS": "vtkMRMLIGTLStatusNode",
    }

    def prepare(self, scene):
        self.scene, self.incoming = scene, {}
        self.SetTypeClient.side_effect = lambda host, port: setattr(self, "place", (host, port))
        self.Start.side_effect = lambda: setattr(self, "client", support.Client(self.place))
        self.Stop.side_effect = lambda: self.client.__exit__()
        self.GetNumberOfIncomingMRMLNodes.side_effect = lambda: len(self.incoming)
        self.GetIncomingMRMLNode.side_effect = lambda n: list(self.incoming.values())[n]
        return self

    def take(self):
        """One message."""
        message = self.client.receive()
        key = (self.KINDS[message.type], message.device)
        if key not in self.incoming:
            self.incoming[key] = self.scene.AddNewNodeByClass(*key)
        node = self.incoming[key]
        node.stamp += 1
        if message.type == "STRING":
            node.GetText.return_value = support.text_of(message)


class Scene:
    """Stands for slicer.mrmlScene."""

    def __init__(self):
        self.nodes = []

    def AddNewNodeByClass(self, kind, name):
        if kind == "vtkMRMLMarkupsFiducialNode":
            node = Points()
        elif kind == "vtkMRMLIGTLConnectorNode":
            node = Connector().of(kind, name).prepare(self)
        else:
            node = Node().of(kind, name)
        self.nodes.append((kind, name, node))
        return node

    def GetFirstNode(self, name, kind):
        return next((n for k, m, n in self.nodes if (k, m) == (kind, name)), None)

    def IsNodePresent(self, node):
        return any(n is node for _, _, n in self.nodes)

    def RemoveNode(self, node):
        self.nodes = [entry for entry in self.nodes if entry[2] is not node]


def stand_ins():
    """Of the modules that the module's file imports."""
    bases = types.ModuleType("slicer.ScriptedLoadableModule")

    class Base:
        def __init__(self, parent=None):
            self.parent, self.layout = parent or mock.MagicMock(), mock.MagicMock()

        def setup(self):
            pass

    for name in ("", "Widget", "Logic", "Test"):
        setattr(bases, "ScriptedLoadableModule" + name, type("Base" + name, (Base,), {}))
    slicer = types.ModuleType("slicer")
    slicer.mrmlScene, slicer.util, slicer.modules = Scene(), mock.MagicMock(), mock.MagicMock()
    slicer.util.startupEnvironment.return_value = None  # that of the test
    slicer.vtkMRMLModelStorageNode = factory()
    slicer.vtkMRMLStorageNode = slicer.vtkMRMLDisplayNode = mock.MagicMock()
    vtk = Widgets("vtk")
    vtk.vtkVector3d = lambda *place: place
    return {
        "slicer": slicer,
        "slicer.ScriptedLoadableModule": bases,
        "vtk": vtk,
        "qt": Widgets("qt"),
        "ctk": Widgets("ctk"),
    }


class Module(support.InFolder):
    def setUp(self):
        super().setUp()
        modules = stand_ins()
        self.slicer = modules["slicer"]
        patched = mock.patch.dict(sys.modules, modules)
        patched.start()
        self.addCleanup(patched.stop)
        sys.modules.pop("LivetetTrack", None)
        self.module = importlib.import_module("LivetetTrack")
        self.widget = self.module.LivetetTrackWidget()
        self.widget.setup()
        self.addCleanup(self.widget.cleanup)
        self.widget.program.currentPath = support.PROGRAM
        self.widget.scene.currentPath = str(self.scene)
        self.logic = self.widget.logic

    def update_until(self, is_done, patience_s=60):
        """As the timer does, with a message before each call."""
        end = time.monotonic() + patience_s
        while not is_done():
            if self.logic.connector:
                try:
                    self.logic.connector.take()
                except (EOFError, OSError):
                    time.sleep(0.02)
            else:
                time.sleep(0.02)
            self.widget.update()
            self.assertLess(time.monotonic(), end, self.logic.details())

    def node(self, kind, name):
        return self.slicer.mrmlScene.GetFirstNode(name, kind)

    def test_a_run_is_shown_from_its_start_to_its_report(self):
        self.widget.on_start()
        self.slicer.util.errorDisplay.assert_not_called()
        self.assertEqual(self.widget.state.text, "Starting, or writing the result")
        self.assertFalse(self.widget.start_button.enabled)
        self.update_until(
            lambda: self.logic.newest.frame
            and self.logic.newest.frame.sensors[0].status == "following"
            and self.node("vtkMRMLLinearTransformNode", "SensorToRAS") is not None
        )
        self.assertEqual(self.logic.connector.place, self.logic.session.address)
        frame = self.logic.newest.frame
        self.assertIn(frame.error_text(), self.widget.state.text)

        points = self.node("vtkMRMLMarkupsFiducialNode", "LivetetTargets")
        self.assertEqual(points.labels, [frame.label(frame.targets[0])])
        self.assertEqual(points.places, [frame.targets[0].position_mm])
        points.display.SetVisibility.assert_called_with(True)
        self.widget.table.setRowCount.assert_called_with(1)
        organ = self.node("vtkMRMLModelNode", "Organ").GetDisplayNode()
        organ.SetActiveScalar.assert_called_once()  # not again with each frame
        region = self.node("vtkMRMLModelNode", "TargetRegion").GetDisplayNode()
        self.assertEqual(region.SetActiveScalar.call_args[0][0], "radius_95_mm")
        self.slicer.modules.createmodels.logic().CreateSphere.assert_called()

        self.widget.on_stop()
        self.update_until(lambda: not self.logic.is_on)
        self.assertIn("largest press", self.logic.details())
        self.assertTrue(self.widget.start_button.enabled)
        points.display.SetVisibility.assert_called_with(False)
        region.SetVisibility.assert_called_with(False)
        self.assertIsNone(self.node("vtkMRMLIGTLConnectorNode", "Livetet"))

    def test_what_may_no_longer_be_true_is_hidden(self):
        self.widget.on_start()
        self.update_until(lambda: self.node("vtkMRMLMarkupsFiducialNode", "LivetetTargets"))
        points = self.node("vtkMRMLMarkupsFiducialNode", "LivetetTargets")
        with mock.patch.object(self.logic.newest, "_clock", lambda: time.monotonic() + 5):
            self.widget.update()
            self.assertIn("nothing that is shown may be true", self.widget.state.text)
            self.assertFalse(self.logic.is_well)
        points.display.SetVisibility.assert_called_with(False)
        self.slicer.mrmlScene.nodes.clear()  # the scene was closed
        self.update_until(lambda: not self.logic.is_on)

    def test_mistakes_are_told(self):
        self.scene.write_text("matrials: []\n")
        self.widget.on_start()
        self.assertIn("matrials", self.slicer.util.errorDisplay.call_args[0][0])
        self.assertFalse(self.logic.is_on)

    def test_image_and_mesh_are_loaded(self):
        self.write_scene()
        self.widget.on_load()
        self.slicer.util.errorDisplay.assert_not_called()
        self.slicer.util.loadVolume.assert_called_once_with(str(self.folder / "grey.nii.gz"))
        (self.folder / "organ.stl").write_text("solid\nendsolid\n")
        self.write_scene(mesh={"file": "organ.stl"}, image="")
        self.widget.on_load()
        self.assertIsNotNone(self.node("vtkMRMLModelNode", "organ.stl at rest"))
