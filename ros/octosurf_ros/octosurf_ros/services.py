"""The services, octosurf_msgs/srv: answered one after the other in a thread of their own."""

import os
import queue
import re
import threading

import numpy as np
import octosurf
from octosurf_msgs import srv
from rclpy.serialization import deserialize_message
from std_srvs.srv import Trigger

from octosurf_ros import messages

USUAL_PLAN_S, LONGEST_PLAN_S = 30, 600  # the client waits, and no search may occupy the node


def vector(point):
    return np.array([point.x, point.y, point.z])


class Services:
    def __init__(self, node, mapping, publications):
        self.mapping, self.publications, self.log = mapping, publications, node.get_logger()
        self.requests = queue.SimpleQueue()
        for name in ("Save", "Load", "Query", "ContactRegions", "Plan", "Changes", "Publish", "Clear"):
            topic = re.sub("(?<=[a-z])(?=[A-Z])", "_", name).lower()
            self.serve(node, topic, getattr(srv, name), getattr(self, topic))
        self.serve(node, "reset", Trigger, lambda _, answer: answer.update(message=mapping.reset()))
        self.serve(node, "locate", Trigger, lambda _, one: one.update(message=mapping.between_scans(mapping.look)))
        threading.Thread(target=self.run, daemon=True, name="services").start()

    def serve(self, node, topic, kind, work):
        # The executor sends at once what a callback returns, and a coroutine that waits keeps it busy. So it is handed
        # the request, and the answer is sent by the thread that makes it.
        service = node.create_service(kind, "~/" + topic, lambda request, _: request)
        send = service.send_response
        service.send_response = lambda request, header: self.requests.put((kind.Response, work, request, send, header))

    def run(self):
        while True:
            kind, work, request, send, header = self.requests.get()
            answer = {"success": True}
            try:
                work(request, answer)
            except Exception as error:  # to the client, whatever it asked
                answer.update(success=False, message=str(error) or type(error).__name__)
            try:
                send(deserialize_message(messages.cdr(kind, answer), kind), header)
            except Exception as error:  # the node is ended
                self.log.warning(f"no answer: {error}")

    def stem_of(self, name):
        """Beside the node's own map only: clients on the network must not write or read elsewhere."""
        if not name:
            return None
        if not re.fullmatch(r"[A-Za-z0-9_-][A-Za-z0-9_.-]{0,99}", name):
            raise ValueError("file is no plain name of a map; give letters, digits, '_', '-' and '.'")
        return os.path.join(os.path.dirname(self.mapping.stem), name)

    def save(self, request, answer):
        answer["message"] = self.mapping.save(self.stem_of(request.file))

    def load(self, request, answer):
        answer["message"] = self.mapping.load(self.stem_of(request.file))

    def publish(self, request, answer):
        if not request.radius >= 0:
            raise ValueError("radius is negative; give 0 for everything")
        self.publications.publish_all(request.radius)

    def clear(self, request, answer):
        q = request.pose.orientation
        turn = np.array([q.x, q.y, q.z, q.w])
        at = octosurf.pose_from_transform(vector(request.pose.position), turn if turn.any() else [0, 0, 0, 1])
        part = octosurf.SpacePart(at, vector(request.size) / 2, request.cylinder)
        answer["message"] = self.mapping.clear(part, request.as_free)
        answer["revision"] = self.mapping.moment.snapshot.revision

    def query(self, request, answer):
        kind, point = request.kind, vector(request.point)
        snapshot, ground = self.mapping.moment[:2]
        index = ground.index(snapshot)
        answer["revision"] = snapshot.revision
        slope = {"up": ground.up, "max_slope_rad": request.max_slope or np.pi}
        within = request.distance or np.inf
        found = None
        if kind == request.NEAREST:
            found = index.nearest(point, within=within, **slope)
        elif kind == request.BELOW:
            found = index.below(point, **slope)
        elif kind == request.RAY:
            found = index.first_on_ray(point, vector(request.direction), within=within)
            answer["front"] = found is not None and found.front
        elif kind == request.SPHERE:
            answer["surfaces"] = index.in_sphere(point, request.distance)
        elif kind == request.BOX:
            corners = np.sort([point, vector(request.corner)], axis=0)
            answer["surfaces"] = index.inside(octosurf.ConvexSpace.box(*corners))
        elif kind == request.VOXEL:
            voxel = snapshot.octree.at(point)
            answer.update(state=("unknown", "free", "occupied").index(voxel.state), log_odds=voxel.log_odds,
                          surfaces=[voxel.surface] if voxel.surface else [])
        elif kind == request.GROUND:
            self.ask_ground(request, point, snapshot, ground, answer)
        else:
            raise ValueError("kind is none of octosurf_msgs/Query")
        if found is not None:
            answer.update(found=True, surfaces=[found.id], point=found.point, distance=found.distance,
                          normal=snapshot.find(found.id).plane.normal)

    def ask_ground(self, request, point, snapshot, ground, answer):
        id = request.surface
        if not id:
            nearest = ground.index(snapshot).nearest(point)
            if nearest is None:
                return
            id = nearest.id
        surface = self.surface(snapshot, id)
        off = surface.plane.signed_distance(point)
        at = point - off * surface.plane.normal
        answer.update(found=True, surfaces=[id], point=at, distance=abs(off), normal=surface.plane.normal,
                      ground=ground.bare(snapshot).ground_at(id, at))

    @staticmethod
    def surface(snapshot, id):
        found = snapshot.find(id)
        if found is None:
            raise ValueError(f"the map has no surface {id}")
        return found

    def contact_regions(self, request, answer):
        snapshot, ground = self.mapping.moment[:2]
        answer["revision"] = snapshot.revision
        sole = request.length != 0 or request.width != 0
        if sole == (request.radius != 0):
            raise ValueError("length, width, radius say no foot, or two; give length and width, or a radius")
        rules = octosurf.GroundRules.of(octosurf.Biped(), snapshot.resolution)
        shape = octosurf.ContactShape
        rules.foot = shape.rectangle(request.length, request.width) if sole else shape.disc(request.radius)
        rules.widest_unseen_m = octosurf.widest_unseen_of(rules.foot)
        rules.as_mapped = request.as_mapped
        usual = rules.limits
        limits = octosurf.ContactLimits(max_slope_rad=usual.max_slope_rad) if request.as_mapped else usual
        limits.up = ground.up
        limits.max_slope_rad = request.max_slope or limits.max_slope_rad
        limits.edge_margin_m = request.edge_margin or limits.edge_margin_m
        limits.clearance_m = request.clearance or limits.clearance_m
        if limits.clearance_m <= 0:
            limits.unknown_to_m = limits.obstacle_margin_m = 0
        limits.obstacle_margin_m = request.obstacle_margin or limits.obstacle_margin_m
        rules.limits = limits
        view, yaw = ground.view(snapshot, rules), None if request.any_heading else request.yaw
        answer["regions"] = regions = []
        for surface in [self.surface(snapshot, request.surface)] if request.surface else snapshot.surfaces:
            if request.reach:
                region = view.region_about(surface.id, vector(request.about), request.reach, yaw)
            else:
                region = view.region(surface.id, yaw)
            pieces = octosurf.convex_pieces(surface, region.polygons, request.pieces)
            regions.append({"surface": region.surface, "revision": region.revision, "area": region.area_m2,
                            "polygons": messages.polygons(surface, region.polygons),
                            "pieces": [{"points": piece.vertices} for piece in pieces], "refused": region.refused})

    def plan(self, request, answer):
        snapshot, ground = self.mapping.moment[:2]
        answer["revision"] = snapshot.revision
        robots = {"": octosurf.Biped, "biped": octosurf.Biped, "quadruped": octosurf.Quadruped}
        if request.robot not in robots:
            raise ValueError(f"robot is neither biped nor quadruped: {request.robot[:40]}")
        robot = robots[request.robot]()
        robot.contact.up = ground.up
        view = ground.view(snapshot, octosurf.GroundRules.of(robot, snapshot.resolution))
        budget = octosurf.PlanBudget(time_s=min(request.time_limit or USUAL_PLAN_S, LONGEST_PLAN_S))
        budget.expansions = request.expansions or budget.expansions
        plan = octosurf.plan(view.solid(), octosurf.Standing(at=vector(request.start), yaw_rad=request.start_yaw),
                             octosurf.Standing(at=vector(request.goal), yaw_rad=request.goal_yaw), robot, budget,
                             octree=snapshot.octree)

        def steps(of):
            return [{"foot": one.foot, "surface": one.surface, "pose": messages.pose(one.T_map_foot),
                     "yaw": one.yaw_rad, "margin": one.margin_m} for one in of]

        answer.update(found=plan.found, message=plan.refusal.sentence if plan.refusal else "",
                      start=steps(plan.start), steps=steps(plan.steps), cost=plan.cost, lower_bound=plan.lower_bound,
                      expansions=plan.expansions)

    def changes(self, request, answer):
        moment, within = self.mapping.moment, None
        low, high = vector(request.low), vector(request.high)
        if (low != high).any():
            box = octosurf.ConvexSpace.box(*np.sort([low, high], axis=0))
            within = set(moment.ground.index(moment.snapshot).inside(box))
        ids = messages.changed_ids(moment.snapshot, request.since, (within, None))
        answer["changes"] = messages.surface_changes(
            moment.snapshot, request.since, ids, self.mapping.options.frame, moment.stamp_ns)
