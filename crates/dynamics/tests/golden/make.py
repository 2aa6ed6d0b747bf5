"""Golden dynamics from Pinocchio: writes <robot>.json and <robot>.urdf beside this file.

    python3 -m venv venv && venv/bin/pip install pin==4.1.0 example-robot-data==6.0.0
    venv/bin/python crates/dynamics/tests/golden/make.py

Pinocchio is Carpentier et al., "The Pinocchio C++ library" (2019). The robots come from the package example-robot-data; each <robot>.urdf
is its file there without visuals, collisions, materials and comments, so that the tests need no package. Same seed, same versions,
same file. Licences: LICENSES.md. Every quantity is that of rigid links: no friction, no rotor inertia, gravity 9.81 m/s^2 along -z of the root.

    q, dq, ddq   rad, rad/s, rad/s^2         drawn uniformly: within the range (at most +-pi), +-2, +-5
    tau          N m                         drawn uniformly within the effort limits
    mass_matrix  kg m^2, upper triangle row by row: (1,1), (1,2), .., (1,N), (2,2), ..
    coriolis     N m, C(q, dq) dq            (rnea without gravity at ddq = 0)
    gravity      N m
    inverse      N m, rnea(q, dq, ddq)
    forward      rad/s^2, aba(q, dq, tau)
    gravity_jacobian  N m/rad, upper triangle
"""

import json
import math
import pathlib
import sysconfig
import xml.etree.ElementTree as ElementTree

import numpy
import pinocchio

HERE = pathlib.Path(__file__).resolve().parent
SEED = 20200306

# name, file in the package, joints of the arm (others are locked at zero), --tip, states, licence of the description
ROBOTS = [
    ("panda", "panda_description/urdf/panda.urdf", [f"panda_joint{i}" for i in range(1, 8)], None, 1000, "Apache-2.0, franka_ros"),
    ("ur5", "ur_description/urdf/ur5_robot.urdf",
     ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint"], None, 100,
     "BSD-3-Clause, ros-industrial/universal_robot"),
    ("kinova", "kinova_description/robots/kinova.urdf", [f"j2s6s200_joint_{i}" for i in range(1, 7)], None, 100,
     "BSD-3-Clause, Kinovarobotics/kinova-ros"),
    ("baxter_left", "baxter_description/urdf/baxter.urdf",
     [f"left_{j}" for j in ["s0", "s1", "e0", "e1", "w0", "w1", "w2"]], "left_gripper", 100,
     "BSD-3-Clause, RethinkRobotics/baxter_common"),
    ("xarm7", "xarm_description/urdf/xarm7.urdf", [f"joint{i}" for i in range(1, 8)], None, 100, "BSD-3-Clause, xArm-Developer/xarm_ros2"),
]

KEPT = {
    "link": {"inertial"},
    "joint": {"origin", "parent", "child", "axis", "limit", "dynamics", "mimic"},
}


def strip(source, relative, licence):
    """The description without what does not move, as text."""
    robot = ElementTree.parse(source).getroot()
    for element in list(robot):
        if element.tag not in KEPT:
            robot.remove(element)
            continue
        for part in list(element):
            if part.tag not in KEPT[element.tag]:
                element.remove(part)
    ElementTree.indent(robot, space=" ")
    note = f"<!-- {relative} of example-robot-data 6.0.0 without visuals and collisions. Licence: {licence}. Written by make.py. -->\n"
    return '<?xml version="1.0"?>\n' + note + ElementTree.tostring(robot, encoding="unicode") + "\n"


def upper(matrix):
    return matrix[numpy.triu_indices(matrix.shape[0])].tolist()


def main():
    package = pathlib.Path(sysconfig.get_paths()["purelib"]) / "cmeel.prefix/share/example-robot-data/robots"
    for name, relative, joints, tip, count, licence in ROBOTS:
        text = strip(package / relative, relative, licence)
        (HERE / f"{name}.urdf").write_text(text)
        whole = pinocchio.buildModelFromXML(text)
        locked = [i for i in range(1, whole.njoints) if whole.names[i] not in joints]
        model = pinocchio.buildReducedModel(whole, locked, pinocchio.neutral(whole))
        assert [model.names[i] for i in range(1, model.njoints)] == joints
        weightless = model.copy()
        weightless.gravity.linear = numpy.zeros(3)
        data, free = model.createData(), weightless.createData()

        def configuration(q):
            parts = []
            for joint, angle in zip(list(model.joints)[1:], q):
                parts += [angle] if joint.nq == 1 else [math.cos(angle), math.sin(angle)]
            return numpy.array(parts)

        lower, top = numpy.full(model.nv, -math.pi), numpy.full(model.nv, math.pi)
        for i, joint in enumerate(list(model.joints)[1:]):
            if joint.nq == 1:
                lower[i] = max(lower[i], model.lowerPositionLimit[joint.idx_q])
                top[i] = min(top[i], model.upperPositionLimit[joint.idx_q])
        effort = numpy.where((model.upperEffortLimit > 0) & numpy.isfinite(model.upperEffortLimit), model.upperEffortLimit, 10.0)
        chance = numpy.random.default_rng(SEED)
        states = []
        for _ in range(count):
            q = chance.uniform(lower, top)
            dq, ddq = chance.uniform(-2, 2, model.nv), chance.uniform(-5, 5, model.nv)
            tau = chance.uniform(-effort, effort)
            x = configuration(q)
            states.append({
                "q": q.tolist(),
                "dq": dq.tolist(),
                "ddq": ddq.tolist(),
                "tau": tau.tolist(),
                "mass_matrix": upper(pinocchio.crba(model, data, x)),
                "coriolis": pinocchio.rnea(weightless, free, x, dq, numpy.zeros(model.nv)).tolist(),
                "gravity": pinocchio.computeGeneralizedGravity(model, data, x).tolist(),
                "inverse": pinocchio.rnea(model, data, x, dq, ddq).tolist(),
                "forward": pinocchio.aba(model, data, x, dq, tau).tolist(),
                "gravity_jacobian": upper(pinocchio.computeGeneralizedGravityDerivatives(model, data, x)),
            })
        head = {
            "robot": name,
            "tip": tip,
            "maker": f"pinocchio {pinocchio.__version__}, example-robot-data 6.0.0, seed {SEED}",
            "source": relative,
            "licence": licence,
            "joints": joints,
        }
        lines = ",\n".join(json.dumps(state, separators=(",", ":")) for state in states)
        (HERE / f"{name}.json").write_text(json.dumps(head, indent=1)[:-2] + ',\n "states": [\n' + lines + "\n]}\n")
        print(name, len(states), "states")


main()
