#!/usr/bin/env python3
"""Whether a humanoid's legs reach planned steps, standing still on each foot in turn, by Pinocchio: pinocchio_steps.py STEPS.json

Each step is two postures of a Talos (of example_robot_data): both soles on the planned footholds, the centre of mass over the one that
stays, then over the one that was placed. A step is feasible if inverse kinematics finds both within the joints' limits, with
the soles to a millimetre and the centre of mass inside of the sole. Fails at the first that is not. Without forces: a slow walk.
"""
import json
import pathlib
import sys

import numpy as np
import pinocchio as pin
from example_robot_data import load

OVER = 0.03  # m: of the centre of mass from the middle of a sole; an eighth of its length
SOLES = {"left": "left_sole_link", "right": "right_sole_link"}


class Legs:
    def __init__(self):
        robot = load("talos_legs")
        self.model, self.data = robot.model, robot.data
        self.soles = {foot: self.model.getFrameId(name) for foot, name in SOLES.items()}
        self.rest = robot.q0.copy()

    def posture(self, soles, over, start):
        """Joints with the soles so and the centre of mass over one of them; None: damped least squares do not find any."""
        q, low, high = start.copy(), self.model.lowerPositionLimit, self.model.upperPositionLimit
        middle = soles[over].translation
        for _ in range(400):
            pin.computeJointJacobians(self.model, self.data, q)
            pin.updateFramePlacements(self.model, self.data)
            mass = pin.centerOfMass(self.model, self.data, q)
            errors, rows = [], []
            for foot, frame in self.soles.items():
                T_sole_goal = self.data.oMf[frame].actInv(soles[foot])
                errors.append(pin.log6(T_sole_goal).vector)
                rows.append(pin.Jlog6(T_sole_goal.inverse()) @ pin.getFrameJacobian(self.model, self.data, frame, pin.LOCAL))
            near = np.linalg.norm(np.concatenate(errors)) < 1e-3
            if near and np.linalg.norm((mass - middle)[:2]) < OVER:
                return q
            errors.append((middle - mass)[:2])
            rows.append(pin.jacobianCenterOfMass(self.model, self.data, q)[:2])
            J, error = np.concatenate(rows), np.concatenate(errors)
            step = J.T @ np.linalg.solve(J @ J.T + 1e-6 * np.eye(len(J)), error)
            q = pin.integrate(self.model, q, step * min(1, 0.3 / np.abs(step).max()))
            q[7:] = np.clip(q[7:], low[7:], high[7:])
        return None


def first_refused(plan):
    """Number of the first step whose postures are not found, and which; None: there is none."""
    legs, place = Legs(), lambda step: pin.SE3(np.reshape(step["T_map_foot"], (4, 4)))
    soles = {step["foot"]: place(step) for step in plan["start"]}
    q = legs.rest
    for number, step in enumerate(plan["steps"], 1):
        stays = next(foot for foot in soles if foot != step["foot"])
        q[:3] = soles[stays].translation + [0, 0, 0.9]
        q[3:7] = pin.Quaternion(soles[stays].rotation).coeffs()
        soles[step["foot"]] = place(step)
        for over in (stays, step["foot"]):
            found = legs.posture(soles, over, q)
            if found is None:
                return number, over
            q = found
    return None


def main():
    plan = json.loads(pathlib.Path(sys.argv[1]).read_text())
    if not plan["found"]:
        sys.exit(plan["refusal"]["sentence"])
    refused = first_refused(plan)
    print("step {}: no posture over the {} foot".format(*refused) if refused else f"all {len(plan['steps'])} steps are within reach")
    sys.exit(refused is not None)


if __name__ == "__main__":
    main()
