"""What simulated robots cost: many in one hall in real time, one on patrol in virtual time.

    python benchmarks/simulation.py [--json] [--quick]

The hall is 60 x 60 m with pillars; every robot drives from one random place to the next, sees the
others and makes room. Figures are CPU time of this process, so that a busy computer disturbs
little: below 1 s for a simulated second is real time on one core. Each is the median of several
stretches.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import math
import random
import statistics
import sys
import time
from dataclasses import replace

import numpy as np

from actionlib_core.action.simple_client import SimpleActionClient
from actionlib_core.clock import VirtualClock, use_clock
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from actionlib_core.node import Node, use_node
from actionlib_core.transport.memory import MemoryNetwork
from smachpy.places.exceptions import NavigationError
from smachpy.places.maps import OFFICE_MAP, OFFICE_ROBOT
from smachpy.places.occupancy import OccupancyMap, load_map
from smachpy.places.pose import Pose2D
from smachpy.places.robot_file import load_config
from smachpy.sim.pilot import Pilot
from smachpy.sim.simulation import Simulation
from smachpy.sim.world import Robot, World
from smachpy.states import goal_at

HALL, CELL, PILLAR = 60.0, 0.1, 0.4  # [m]
RATE = 20.0  # [Hz]
BUDGETS = {  # at most
    "200 robots drive: CPU s per s": 1.0,
    "200 robots stand: CPU s per s": 0.01,
    "one robot drives with its client: CPU s per h": 9.0,
}


def hall():
    """An empty hall with a pillar every ten metres."""
    side = round(HALL / CELL)
    cells = np.zeros((side, side), dtype=np.int8)
    cells[:2] = cells[-2:] = 100
    cells[:, :2] = cells[:, -2:] = 100
    half = round(PILLAR / 2 / CELL)
    for row in range(round(5 / CELL), side, round(10 / CELL)):
        for column in range(round(5 / CELL), side, round(10 / CELL)):
            cells[row - half : row + half, column - half : column + half] = 100
    return OccupancyMap(cells, CELL, Pose2D(0.0, 0.0, 0.0))


def config_of_the_office():
    config = load_config(OFFICE_ROBOT)
    return replace(config, dock=None, battery=replace(config.battery, capacity=1e4, charge=1.0))


class Crowd:
    """Robots that drive for ever, without a network."""

    def __init__(self, count, seed=1):
        self.random = random.Random(seed)
        self.world = World(hall())
        config = config_of_the_office()
        self.goals = [self.place() for _ in range(60)]  # as stations are: some are shared
        robots = []
        while len(robots) < count:
            with contextlib.suppress(NavigationError):
                name = f"robot_{len(robots)}"
                robots.append(Robot(self.world, config, self.place(), 0.0, name))
        self.pilots = [Pilot(robot) for robot in robots]
        self.now, self.arrived, self.failed = 0.0, 0, 0

    def place(self):
        while True:
            x, y = (self.random.uniform(1.0, HALL - 1.0) for _ in range(2))
            beside = [abs((v - 5.0 + 5.0) % 10.0 - 5.0) for v in (x, y)]
            if max(beside) > 1.0:
                return Pose2D(x, y, self.random.uniform(-math.pi, math.pi))

    def send(self, pilot):
        def done(trouble):
            self.arrived += not trouble
            self.failed += bool(trouble)

        pilot.drive(self.random.choice(self.goals), done)

    def run(self, seconds, *, drive=True):
        dt = 1.0 / RATE
        for _ in range(round(seconds * RATE)):
            self.world.step(dt)
            for pilot in self.pilots:
                if drive and not pilot.is_busy(self.now):
                    self.send(pilot)
                if pilot.is_busy(self.now):
                    pilot.step(self.now, dt)
                for tell in pilot.take_ends():
                    tell()
            self.now += dt


def measure(run, seconds, rounds):
    """Return the median CPU time [s] for a simulated second."""
    times = []
    for _ in range(rounds):
        start = time.process_time()
        run(seconds)
        times.append((time.process_time() - start) / seconds)
    return statistics.median(times)


def driving(count, seconds, rounds):
    crowd = Crowd(count)
    crowd.run(10.0)  # plans of the first goals, trees of all goals
    cost = measure(crowd.run, seconds, rounds)
    driven = sum(pilot.robot.odometer for pilot in crowd.pilots)
    return {
        f"{count} robots drive: CPU s per s": cost,
        f"{count} robots drive: mean speed m/s": driven / count / crowd.now,
        f"{count} robots drive: arrivals": crowd.arrived,
        f"{count} robots drive: given up": crowd.failed,
    }


@contextlib.contextmanager
def served(world):
    with VirtualClock() as clock, use_clock(clock):
        session = MemoryNetwork(clock).session()
        with Node("benchmark", transport=session, clock=clock) as node, use_node(node):
            simulation = Simulation(world, node=node)
            simulation.start()
            try:
                yield clock
            finally:
                simulation.close()


def standing(count, seconds, rounds):
    with served(Crowd(count).world) as clock:
        return {f"{count} robots stand: CPU s per s": measure(clock.sleep, seconds, rounds)}


def alone(seconds):
    """One robot in the office, its client in the same process, in virtual time."""
    world = World(load_map(OFFICE_MAP))
    config = config_of_the_office()
    Robot(world, config, config.start, 0.0, "robot_0")
    places = [(2.0, 3.0), (4.6, 10.6), (16.5, 10.4), (24.3, 10.5), (17.3, 5.3)]
    with served(world) as clock:
        client = SimpleActionClient("robot_0/move_base", MoveBaseAction)
        client.wait_for_server(1.0)

        def drive(until):
            heard = []
            while clock.now() < until:
                x, y = places[len(heard) % len(places)]
                heard.append((x, y))
                client.send_goal(goal_at(Pose2D(x, y, 0.0)), feedback_cb=heard.append)
                client.wait_for_result()

        drive(100.0)
        start, begun = time.process_time(), clock.now()
        drive(begun + seconds)
        cost = (time.process_time() - start) / (clock.now() - begun)
    return {"one robot drives with its client: CPU s per h": cost * 3600.0}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--quick", action="store_true")
    args = parser.parse_args()
    seconds, rounds = (5.0, 1) if args.quick else (10.0, 5)
    figures = {}
    for count in (50,) if args.quick else (50, 200):
        figures |= driving(count, seconds, rounds)
    figures |= standing(200, 60.0, rounds)
    figures |= alone(300.0 if args.quick else 1800.0)
    if args.json:
        print(json.dumps(figures, indent=2))
    else:
        for name, value in figures.items():
            limit = f"   (at most {BUDGETS[name]:g})" if name in BUDGETS else ""
            print(f"{name:50} {value:10.4g}{limit}")
    return any(figures[name] > limit for name, limit in BUDGETS.items() if name in figures)


if __name__ == "__main__":
    sys.exit(main())
