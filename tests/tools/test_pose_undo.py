"""Every edit, action and tool of the pose craft, in any order, is undone, redone, saved and recovered to the bit."""

import functools
import inspect

import numpy as np
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import initialize, rule

from core.document import Document, MeshObject, problems
from core.formats.mesh_file import write_mesh
from core.pose.keying import still_clip
from core.pose.pose import REST, Pose
from core.pose.pose_space import PoseLayer
from core.pose.rig import Constraint, Control, all_clips
from core.pose.synthesis import evaluate, pose_at
from core.record import freeze
from core.workspace import Respect, Workspace
from tests.tools.pose_scenes import document, rig, strip, turned
from tests.tools.scenes import pointers, sight
from tests.tools.some_params import some_params
from tests.tools.undo_machine import UndoMachine
from tools import control_edits, pose_edits, posing_edits, skin_edits
from tools.pose.actions import ACTIONS
from tools.registry import Registry

TOOLS = {kind.name: kind for kind in Registry(()).of("pose")}
MODULES = (pose_edits, posing_edits, skin_edits, control_edits)
EDITS = {
    name: function for module in MODULES for name, function in inspect.getmembers(module, inspect.isfunction)
    if function.__module__ == module.__name__ and not name.startswith("_")
    and inspect.signature(function).return_annotation == "Document"}  # fmt: skip
BENT, TWIN = turned("bent", arm_L=(0, 40, 30)), turned("twin", arm_L=(0, 40, 30))
POSES = (
    BENT, TWIN, turned("far", arm_L=(0, 90, 60)), turned("both", arm_L=(0, 40, 0), arm_R=(0, -40, 0)), REST,
    turned("twisted", arm_R=(180, 0, 0)), Pose(name="grin", numbers={"smile_L": 1.0}),
    turned("all", {"smile_R": 0.5}, arm_L=(0, 20, 0)).replace(translations={"lid": (0.0, 0.2, 0.0)}),
    Pose(name="noise", rotations={"arm_R": (1e-9, 0, 0, 1), "arm_L": (0.0, 0.3, 0.0, 0.9)}),
)  # fmt: skip


@functools.cache
def start() -> Document:
    """A sculpt on one arm, a library, a clip, a lock."""
    made = document(joint_selection=("arm_L",), locked_joints=("root",), library=(turned("kept", arm_R=(0, 20, 0)),))
    made = posing_edits.key_pose(made, 1, BENT, 1010.0)
    return pose_edits.add_sculpt(made, 1, BENT, strip().points + np.float32([0.0, 0.0, 0.02]))


class Some:
    """Draws what edits are called with: mostly what there is, sometimes what there is not."""

    def __init__(self, made, draw, folder):
        self.item: MeshObject = made.meshes[0]
        self.draw, self.folder = draw, folder
        layers = () if self.item.correctives is None else self.item.correctives.layers
        self.layers: tuple[PoseLayer, ...] = layers
        self.samples = [s.name for layer in layers for s in layer.space.samples]

    def of(self, *choices):
        return self.draw(st.sampled_from(choices))

    def number(self, low, high):
        return self.draw(st.floats(low, high))

    @property
    def pose(self):
        return self.of(*POSES, *self.item.library)

    @property
    def sample(self):
        return self.of(*self.samples, "nobody")

    @property
    def layer(self):
        return self.of(*(layer.name for layer in self.layers), "nowhere")

    @property
    def joint(self):
        return self.of(*self.item.rig.skeleton.names, "knee")

    @property
    def control(self):
        return self.of(*(c.name for c in self.item.rig.controls), "none")

    @property
    def name(self):
        return self.of("one", "two", "three", "smile_L", " ", "rest")

    @property
    def side(self):
        return self.of("+X", "-X")

    @property
    def key(self):
        """A frame of the clip, one that has a key where there is any."""
        clip = self.item.rig.clip
        frames = () if clip is None else tuple(float(clip.start + key) for key in clip.keys)
        return self.of(1010.0, *frames)

    @property
    def surface(self):
        push = self.draw(st.tuples(*[st.floats(-0.05, 0.05)] * 3))
        part = strip().points[:, :1] * self.of(1.0, -1.0) > self.of(-2.0, 0.0, 0.4)
        return self.of(None, (strip().points + part * np.array(push)).astype(np.float32))


# what each edit is called with after the id of the mesh
ARGUMENTS = {
    "add_sculpt": lambda s: (s.pose, s.surface, None, None, {"twins": s.of("refuse", "merge", "delete")}),
    "add_sculpt_as_seen": lambda s: (s.pose, s.of("refuse", "merge", "delete")),
    "import_sculpt": lambda s: (s.pose, s.folder / s.of("good.obj", "bad.obj", "none.obj")),
    "restore_sculpt": lambda s: (s.pose, s.of("", s.sample, "kept"), s.number(0, 1)),
    "mirror_sculpt": lambda s: (s.sample, s.of("topology", "axis"), s.side),
    "remove_pose": lambda s: (s.sample,), "merge_poses": lambda s: ((s.sample, s.sample),),
    "move_pose": lambda s: (s.sample, s.pose), "rename_pose": lambda s: (s.sample, s.name),
    "rename_layer": lambda s: (s.layer, s.name), "set_layer_enabled": lambda s: (s.layer, s.of(True, False)),
    "set_space": lambda s: (s.layer, s.of(
        {"kernel": "thin-plate"}, {"kernel": "shepard"}, {"weighted": 4}, {"affine": True}, {"smoothing": 0.01},
        {"kernel": "gaussian"}, {"kernel": "no such"}, {"smoothing": -1.0})),
    "set_falloff": lambda s: (s.sample, s.of("arm_L", "arm_R", "smile_L"), s.of(None, (0.3,), (2.0,))),
    "set_reading": lambda s: (s.layer, s.of("arm_L", "arm_R"), s.of("swing", "twist", "swing-twist", "x", "y")),
    "set_way": lambda s: (s.of("pose-space", "linear", "combination", "interpolation"),),
    "hold_pose": lambda s: (s.of(None, s.pose),), "select_joints": lambda s: ((s.joint, s.joint),),
    "keep_pose": lambda s: (s.pose,), "forget_pose": lambda s: (s.of("kept", "bent", "nobody"),),
    "play_clip_file": lambda s: (rig().replace(clip=still_clip(rig().skeleton, 0.0, 5, 12.0, "walk")),),
    "set_constraints": lambda s: (s.of((), (Constraint(joint="arm_R", kind="orient", target="arm_L", weight=0.5),)),),
    "mirror_pose": lambda s: (s.pose, s.of("whole pose", "selected joints")),
    "reset_pose": lambda s: (s.pose, s.of(None, (s.joint,))),
    "apply_pose": lambda s: (s.pose, s.of("kept", s.sample), s.number(0, 1)),
    "key_pose": lambda s: (s.pose, s.number(995, 1030)),
    "mirror_weights": lambda s: (s.side,), "normalise_weights": lambda s: (),
    "smooth_weights": lambda s: (s.number(0, 1), s.of(1, 2), s.of(None, s.joint)),
    "limit_influences": lambda s: (s.of(1, 2, 4),), "prune_weights": lambda s: (s.number(0, 0.4),),
    "lock_joints": lambda s: ((s.joint,), s.of(True, False)),
    "edit_mask": lambda s: (s.of("clear", "invert", "grow", "shrink", "blur"), s.of(1, 2)),
    "set_skin": lambda s: (s.of(rig().skin, s.item.rig.skin),),
    "add_control": lambda s: (Control(name=s.name.strip() or "x", low=-1.0),),
    "add_dial": lambda s: (s.name, s.of(0.0, -1.0, 2.0), 1.0),
    "add_pad": lambda s: (s.name, s.name), "add_joint_control": lambda s: (s.name, s.joint),
    "add_geometry_control": lambda s: (s.name, s.of([0, 1], [], [999])), "add_masked_control": lambda s: (s.name,),
    "edit_control": lambda s: (s.control, s.of({"name": "renamed"}, {"low": -2.0}, {"high": -3.0}, {"rest": 0.25})),
    "change_control": lambda s: (s.control, s.of("", "called"), s.of(0.0, -1.0, 1.0), 1.0, s.of(0.0, 0.5)),
    "remove_control": lambda s: (s.control,),
    "limit_joint": lambda s: (s.joint, (-0.3, -0.3, s.of(-0.3, 9.0)), (0.3, 0.3, 0.3)),
    "constrain_joint": lambda s: (s.joint, s.joint, s.of("aim", "point", "orient"), s.number(0, 1)),
    "free_joints": lambda s: ((s.joint,),),
    "delete_pose_keys": lambda s: ((s.key,),), "move_pose_keys": lambda s: ((s.key,), s.of(0.0, 3.0, -2.0)),
    "edit_constraint": lambda s: (s.of(0, 5), s.of({"weight": 0.25}, {"weight": -1.0}, {"nothing": 1})),
    "remove_constraint": lambda s: (s.of(0, 5),),
}


def test_every_function_that_makes_a_document_has_arguments():
    assert set(EDITS) == set(ARGUMENTS) | {"add_rig"}  # which makes a mesh of its own


def call(made, name, some):
    """An edit of the mesh; a dictionary at the end is passed by name."""
    arguments = ARGUMENTS[name](some)
    named = arguments[-1] if arguments and isinstance(arguments[-1], dict) else {}
    return EDITS[name](made, 1, *arguments[: len(arguments) - bool(named)], **named)


class PoseEdits(UndoMachine):
    """Edits, actions and strokes on one small rig."""

    workspace = Workspace(mesh=1, craft="pose", frame=1010.0)

    @initialize()
    def start(self):
        self.first = start()
        super().start()
        quads = strip().corners.reshape(-1, 4).copy()
        write_mesh(self.folder / "good.obj", strip().replace(points=freeze(strip().points + np.float32(0.01))))
        quads[3] = quads[3, [0, 2, 1, 3]] + 5
        write_mesh(self.folder / "bad.obj", strip().replace(corners=freeze(quads.ravel())))

    def some(self, data):
        return Some(self.session.document, data.draw, self.folder)

    @rule(name=st.sampled_from(sorted(ARGUMENTS)), data=st.data())
    def edit(self, name, data):
        self.done(self.session.edit, name, call, name, self.some(data))
        self.is_sound()

    @rule(name=st.sampled_from(sorted(ACTIONS)), seed=st.integers(0, 2**31 - 1), named=st.booleans(), data=st.data())
    def action(self, name, seed, named, data):
        params = some_params(np.random.default_rng(seed), ACTIONS[name])
        for field in ("pose", "into", "towards", "name"):
            if field in params and (named or name in ("delete_control", "edit_control")):
                params[field] = self.some(data).sample if field != "name" else self.some(data).name
            elif field in params:
                del params[field]
        if "file" in params:
            params["file"] = str(self.folder / self.some(data).of("good.obj", "bad.obj"))
        before = self.session.document
        self.done(self.session.act, name, **params)
        if self.session.document is not before:
            assert self.session.history.undo_name == ACTIONS[name].step
        self.is_sound()

    @rule(name=st.sampled_from(sorted(TOOLS)), seed=st.integers(0, 2**31 - 1), symmetry=st.booleans())
    def stroke(self, name, seed, symmetry):
        rng = np.random.default_rng(seed)
        self.session.choose(name, **some_params(rng, TOOLS[name]))
        self.session.set_workspace(respect=Respect(symmetry=symmetry), frame=float(rng.choice([1001.0, 1010.0])))
        way = rng.uniform((80, 175), (320, 225)) + np.cumsum(rng.normal(0.0, 20.0, (4, 2)), axis=0)
        keys = {key: bool(rng.random() < 0.2) for key in ("shift", "ctrl", "eraser")}
        self.done(self.session.hand.stroke, sight(), pointers(way, **keys))
        assert not self.session.stroking
        self.is_sound()

    @rule(name=st.sampled_from(sorted(ARGUMENTS)), data=st.data())
    def preview_and_cancel(self, name, data):
        self.shown_and_cancelled(call, name, self.some(data))

    def is_sound(self):
        """The rig can be posed and saved, and a finite surface comes of it."""
        made = self.session.document
        item = made.meshes[0]
        assert problems(made) == []
        assert item.surface is None
        np.testing.assert_allclose(item.rig.skin.weights.sum(axis=1), 1.0, atol=1e-5)
        for pose in (item.pose or REST, pose_at(item.rig, 1012.5)):
            assert np.isfinite(evaluate(item.mesh.points, item.rig, item.correctives, pose)).all()
        for clip in all_clips(item.rig):
            assert np.isfinite(clip.rotations).all()


TestPoseEdits = PoseEdits.TestCase
TestPoseEdits.settings = settings(
    max_examples=15, stateful_step_count=20, deadline=None, suppress_health_check=list(HealthCheck))
