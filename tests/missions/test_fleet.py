"""The fleet in virtual time: light robots that drive in straight lines, and the truth about parcels.

The truth (`Yard`) is kept apart from the coordinator's books: who really took and gave what.
"""

from __future__ import annotations

import contextlib
import random
import subprocess
import sys
from collections import Counter

import pytest

from actionlib_core.action.simple_server import SimpleActionServer
from actionlib_core.interfaces.geometry_msgs.msg import PoseStamped
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction, MoveBaseFeedback
from actionlib_core.interfaces.sensor_msgs.msg import BatteryState
from actionlib_core.node import Node, use_node
from actionlib_core.pubsub.topic import Publisher
from actionlib_core.transport.faulty import DELIVERED, FaultyTransport
from actionlib_core.transport.memory import MemoryNetwork
from actionlib_core.wire.presence import list_endpoints
from smachpy.checks import check
from smachpy.exceptions import MissionError
from smachpy.places.exceptions import InputFileError
from smachpy.places.maps import OFFICE_FLEET
from smachpy.places.pose import Pose2D
from smachpy.sim.interfaces import ChargeAction
from smachpy.sim.world_file import load_world
from smachpy.states import Waypoint, pose_of, serve_during
from smachpy_missions.fleet.coordinator import coordinator, fleet, make_orders, pose_message
from smachpy_missions.fleet.dispatcher import Dispatcher, Robot
from smachpy_missions.fleet.order_book import Order, Stage
from smachpy_missions.fleet.processes import world_text
from smachpy_missions.fleet.robot import FleetRobot, deliver, recharge
from smachpy_missions.fleet.robot import main as robot_main
from smachpy_missions.fleet.site import load_site
from smachpy_missions.interfaces.srv import PermitRequest

SPEED = 1.0  # [m/s]
STEP = 2.0  # [s] between two reports of a drive
REACH = 0.1  # [m] a parcel this near can be taken
AT_DOCK = 0.3  # [m]


class Yard:
    """What is really the case: where the parcels and the robots are."""

    def __init__(self, orders):
        self.parcels = {order.name: order.pickup.pose for order in orders}  # a place or a robot
        self.given = Counter()
        self.robots = {}
        self.violations = []
        self.docks = ()

    def find(self, order, pose):
        """Whether the parcel lies at `pose`, or on a robot that stands dead there."""
        where = self.parcels.get(order)
        if isinstance(where, str):
            other = self.robots[where]
            where = None if other.alive else other.pose
        return where is not None and where.distance(pose) < REACH

    def moved(self, robot):
        for dock in self.docks:
            there = [r.name for r in self.robots.values() if r.pose.distance(dock.pose) < AT_DOCK]
            if len(there) > 1:
                self.violations.append((dock.name, sorted(there)))


class LightHands:
    """Hands that change the yard; `hooks` run right after the deed."""

    def __init__(self, yard, body):
        self.yard, self.body = yard, body
        self.hooks = {}

    def take(self, order):
        if not self.body.alive or not self.yard.find(order, self.body.pose):
            return False
        self.yard.parcels[order] = self.body.name
        self.hooks.get("take", lambda: None)()
        return self.body.alive

    def put_back(self, order):
        if self.body.alive:
            self.yard.parcels[order] = self.body.pose

    def give(self, order):
        if self.body.alive:
            assert self.yard.parcels[order] == self.body.name
            del self.yard.parcels[order]
            self.yard.given[order] += 1
            self.hooks.get("give", lambda: None)()


class LightRobot:
    """Body and mission of one robot, on a session of its own."""

    def __init__(self, yard, network, clock, robot, charge=1.0, drain=0.0):
        self.yard, self.clock, self.name, self.pose = yard, clock, robot.name, robot.home
        self.alive, self.charge, self.drain = True, charge, drain
        yard.robots[self.name] = self
        self.session = network.session()
        self.link = FaultyTransport(self.session, lambda _key, _n: DELIVERED, clock=clock)
        self.node = Node("robot", transport=self.link, clock=clock, namespace=robot.name)
        self.battery = Publisher("battery", BatteryState, latch=True, node=self.node)
        self.battery.publish(percentage=charge)
        self.base = SimpleActionServer("move_base", MoveBaseAction, self.drive, node=self.node)
        self.dock = SimpleActionServer("charge", ChargeAction, self.fill, node=self.node)
        self.hands = LightHands(yard, self)
        self.mission = FleetRobot(robot.name, self.hands, node=self.node)

    def drive(self, goal):
        start, end = self.pose, pose_of(goal.target_pose.pose)
        distance, done = start.distance(end), 0.0
        while done < distance:
            step = min(STEP, (distance - done) / SPEED)
            if self.base.wait_preempt(step) or not self.alive:
                self.base.set_preempted()
                return
            done += step * SPEED
            share = min(1.0, done / distance)
            x, y = start.x + (end.x - start.x) * share, start.y + (end.y - start.y) * share
            self.pose = Pose2D(x, y, end.yaw)
            self.charge -= self.drain * step * SPEED
            self.yard.moved(self)
            self.base.publish_feedback(MoveBaseFeedback(PoseStamped(pose=pose_message(self.pose))))
        self.pose = end
        self.battery.publish(percentage=self.charge)
        self.base.set_succeeded()

    def fill(self, goal):
        if self.dock.wait_preempt(60.0):
            self.dock.set_preempted()
            return
        self.charge = goal.until
        self.battery.publish(percentage=self.charge)
        self.dock.set_succeeded()

    def kill(self):
        """Die as a process does that gets SIGKILL."""
        self.alive = False
        self.session.kill()

    def close(self):
        if self.alive:
            self.mission.close()
            self.node.close()


class Floor:
    """Robots, yard, dispatcher and the coordinator's machine."""

    def __init__(self, clock, robots, orders, docks=(), low=0.0, **body):
        self.clock = clock
        self.network = MemoryNetwork(clock)
        self.yard = Yard(orders)
        self.yard.docks = docks
        self.on_permit = lambda _robot, _step: None
        self.dispatcher = Dispatcher(
            robots, orders, docks, low=low, on_permit=lambda r, s: self.on_permit(r, s)
        )
        self.machine = coordinator(self.dispatcher, 0.9)
        serve_during(self.machine, self.dispatcher.serve)
        self.robots = [
            LightRobot(self.yard, self.network, clock, robot, **body) for robot in robots
        ]
        self.node = Node("coordinator", transport=self.network.session(), clock=clock)

    def run(self):
        with use_node(self.node):
            return self.machine.execute()

    def ask_in_turn(self):
        """Let each robot's line ask for its first task a second after the one before it."""
        late = {robot.name: float(n) for n, robot in enumerate(self.robots)}
        ask = self.dispatcher.next_task

        def next_task(robot):
            self.clock.sleep(late.pop(robot, 0.0))
            return ask(robot)

        self.dispatcher.next_task = next_task

    def at(self, seconds, do):
        """Do something `seconds` after the start."""

        def wait():
            self.clock.sleep(seconds)
            do()

        self.clock.spawn(wait, name="test")

    def entry(self, name):
        return self.dispatcher.book.entries[name]

    def stages(self):
        return Counter(entry.stage for entry in self.dispatcher.book.entries.values())

    def check(self):
        """What must hold whatever happened."""
        book = self.dispatcher.book
        assert not book.open
        for name, entry in book.entries.items():
            given = self.yard.given[name]
            assert given <= 1, f"{name} was handed over {given} times"
            if entry.stage is Stage.DELIVERED:
                assert given == 1, f"{name} is booked as delivered, and was not"
            elif entry.stage is Stage.UNDELIVERED:
                assert given == 0, f"{name} is booked as undelivered, and was handed over"
            assert (entry.reason == "") == (entry.stage is Stage.DELIVERED)
        assert self.yard.violations == []

    def close(self):
        for robot in self.robots:
            robot.close()
        self.node.close()


@pytest.fixture
def floor_of(clock):
    with contextlib.ExitStack() as stack:

        def make(*args, **options):
            floor = Floor(clock, *args, **options)
            stack.callback(floor.close)
            return floor

        yield make


def place(name, x, y=0.0):
    return Waypoint(name, Pose2D(x, y, 0.0))


def team(count):
    return [Robot(f"robot_{n}", Pose2D(0.0, float(n), 0.0)) for n in range(count)]


ONE = [Order("order 1", place("shelf", 10.0), place("desk", 30.0))]


# -- one order -------------------------------------------------------------------------------------


def test_an_order_is_fetched_and_handed_over(clock, floor_of):
    floor = floor_of(team(1), ONE)
    assert floor.run() == "succeeded"
    floor.check()
    assert floor.yard.given == {"order 1": 1}
    assert floor.robots[0].pose == Pose2D(0.0, 0.0, 0.0)  # home again
    assert clock.now() == pytest.approx(10 + 2 + 20 + 2 + 30, abs=0.1)
    assert floor.machine.userdata.report == "1 delivered, 0 in doubt, 0 undelivered"


def kill_in(state):
    """Kill robot_0 one second after it has entered a state of its mission."""

    def arm(floor):
        steps = {
            "TO_PICKUP": lambda: floor.at(5.0, floor.robots[0].kill),
            "TAKE": lambda: floor.at(11.0, floor.robots[0].kill),
            "TO_DROPOFF": lambda: floor.at(19.0, floor.robots[0].kill),
            "GIVE": lambda: floor.at(33.0, floor.robots[0].kill),
        }
        steps[state]()

    return arm


def kill_after(deed):
    return lambda floor: floor.robots[0].hands.hooks.update({deed: floor.robots[0].kill})


def kill_as_granted(step):
    """The permission is written down, and its answer never arrives."""

    def arm(floor):
        def on_permit(robot, granted):
            if (robot, granted) == ("robot_0", step):
                floor.robots[0].kill()

        floor.on_permit = on_permit

    return arm


@pytest.mark.parametrize(
    ("arm", "stage", "given"),
    [
        (kill_in("TO_PICKUP"), Stage.DELIVERED, 1),
        (kill_as_granted(PermitRequest.PICK_UP), Stage.DELIVERED, 1),
        (kill_in("TAKE"), Stage.DELIVERED, 1),
        (kill_after("take"), Stage.DELIVERED, 1),
        (kill_as_granted(PermitRequest.DRIVE_OFF), Stage.DELIVERED, 1),
        (kill_in("TO_DROPOFF"), Stage.DELIVERED, 1),
        (kill_as_granted(PermitRequest.HAND_OVER), Stage.IN_DOUBT, 0),
        (kill_in("GIVE"), Stage.IN_DOUBT, 0),
        (kill_after("give"), Stage.IN_DOUBT, 1),
    ],
)
def test_a_robot_that_dies_with_an_order(floor_of, arm, stage, given):
    floor = floor_of([*team(1), Robot("robot_1", Pose2D(0.0, 500.0, 0.0))], ONE)
    floor.ask_in_turn()
    arm(floor)
    outcome = floor.run()
    floor.check()
    entry = floor.entry("order 1")
    assert (entry.stage, floor.yard.given["order 1"]) == (stage, given)
    assert outcome == ("succeeded" if stage is Stage.DELIVERED else "undelivered")
    if stage is Stage.DELIVERED:
        assert (entry.robot, entry.attempt, entry.failed) == ("robot_1", 2, ["robot_0"])
    else:
        assert entry.reason == "robot_0 was lost while it was handing over"


def test_the_last_robot_dies(floor_of):
    floor = floor_of(team(1), ONE)
    kill_in("TO_PICKUP")(floor)
    assert floor.run() == "undelivered"
    floor.check()
    assert floor.entry("order 1").reason == (
        "robot_0 was lost while it was handed out; no other robot is left"
    )


def test_a_robot_whose_link_is_cut_delivers_nothing_that_was_given_to_another(floor_of):
    floor = floor_of([*team(1), Robot("robot_1", Pose2D(0.0, 500.0, 0.0))], ONE)
    floor.ask_in_turn()
    floor.at(15.0, floor.robots[0].link.cut)
    assert floor.run() == "undelivered"
    floor.check()
    assert floor.yard.parcels["order 1"] == "robot_0"  # it kept it: nobody said that it may
    assert floor.entry("order 1").failed == ["robot_0", "robot_1"]


def test_a_robot_that_cannot_reach_the_parcel_leaves_it_to_another(floor_of):
    floor = floor_of(team(2), ONE)
    floor.ask_in_turn()
    floor.robots[0].drive = None
    floor.robots[0].base.execute_callback = lambda _goal: floor.robots[0].base.set_aborted()
    outcome = floor.run()
    floor.check()
    assert outcome == "succeeded"
    assert floor.entry("order 1").robot == "robot_1"


def test_a_robot_that_is_stuck_with_a_parcel_is_out_and_the_order_reported(floor_of):
    floor = floor_of(team(2), ONE)
    floor.ask_in_turn()
    robot = floor.robots[0]
    drive = robot.base.execute_callback

    def stuck(goal):
        if pose_of(goal.target_pose.pose).x == 30.0:
            robot.base.set_aborted()
        else:
            drive(goal)

    robot.base.execute_callback = stuck
    assert floor.run() == "undelivered"
    floor.check()
    assert floor.entry("order 1").reason == "aboard robot_0: driving to the dropoff"


def test_without_a_coordinator_nothing_is_taken(clock, floor_of):
    floor = floor_of(team(1), ONE)
    floor.at(5.0, floor.node.transport.kill)
    with use_node(floor.node), contextlib.suppress(Exception):
        floor.machine.execute()
    clock.sleep(200.0)
    assert floor.yard.parcels["order 1"] == Pose2D(10.0, 0.0, 0.0)
    assert not floor.yard.given


def test_a_fleet_that_is_stopped_says_where_the_parcels_are(clock, floor_of):
    orders = [*ONE, Order("order 2", place("far shelf", 200.0), place("desk", 30.0))]
    floor = floor_of(team(2), orders)
    floor.ask_in_turn()
    floor.at(20.0, floor.machine.request_preempt)
    assert floor.run() == "preempted"
    floor.check()
    assert clock.now() < 25.0
    assert floor.entry("order 1").reason.startswith("aboard robot_0")
    assert "order 2: undelivered" in floor.machine.userdata.report


def test_it_can_run_again(floor_of):
    floor = floor_of(team(2), make_orders([place("a", 5.0), place("b", 9.0)], 3, 1))
    assert floor.run() == "succeeded"
    floor.yard.parcels.update({o.name: o.pickup.pose for o in floor.dispatcher._orders})
    floor.yard.given.clear()
    assert floor.run() == "succeeded"
    floor.check()


# -- docks -----------------------------------------------------------------------------------------


def docks(count):
    return tuple(Waypoint(f"dock {n}", Pose2D(-5.0, 3.0 * n, 0.0)) for n in range(count))


def test_robots_wait_for_their_turn_at_the_dock(floor_of):
    orders = make_orders([place("a", 5.0), place("b", 9.0), place("c", 7.0, 5.0)], 12, 2)
    floor = floor_of(team(4), orders, docks(1), low=0.5, charge=0.6, drain=0.005)
    assert floor.run() == "succeeded"
    floor.check()
    assert floor.dispatcher.docks.holders == {}


def test_the_dock_of_a_robot_that_died_there_stays_taken(floor_of):
    orders = make_orders([place("a", 5.0), place("b", 9.0)], 4, 3)
    floor = floor_of(team(2), orders, docks(1), low=0.95, charge=0.5)
    floor.at(30.0, lambda: next(r for r in floor.robots if r.pose.x == -5.0).kill())
    assert floor.run() == "undelivered"
    floor.check()
    ((dock, robot),) = floor.dispatcher.docks.blocked.items()
    assert dock == "dock 0"
    assert f"dock 0: needs to be checked, {robot} had it" in floor.machine.userdata.report


def test_a_robot_that_cannot_charge_leaves_the_dock_and_its_duty(floor_of):
    orders = make_orders([place("a", 5.0), place("b", 9.0)], 3, 3)
    floor = floor_of(team(2), orders, docks(1), low=0.5, charge=0.4)
    broken, fine = floor.robots
    broken.dock.execute_callback = lambda _goal: broken.dock.set_aborted()
    assert floor.run() == "succeeded"
    floor.check()
    assert (floor.dispatcher.docks.holders, floor.dispatcher.docks.blocked) == ({}, {})
    by = Counter(entry.robot for entry in floor.dispatcher.book.entries.values())
    assert by == {"robot_0": 1, "robot_1": 2}  # its first, before anybody knew of its battery
    assert broken.pose == Pose2D(0.0, 0.0, 0.0)
    assert fine.charge == pytest.approx(0.9)


# -- many ------------------------------------------------------------------------------------------


def many(clock, floor_of, *, robots, orders, kills, seed):
    pick = random.Random(seed)
    places = [place(f"place {n}", pick.uniform(0, 60), pick.uniform(0, 60)) for n in range(20)]
    stations = tuple(Waypoint(f"dock {n}", Pose2D(-9.0, 4.0 * n, 0.0)) for n in range(robots // 5))
    floor = floor_of(
        team(robots),
        make_orders(places, orders, seed),
        stations,
        low=0.4,
        charge=0.7,
        drain=0.003,
    )
    for robot in pick.sample(floor.robots, kills):
        floor.at(pick.uniform(1.0, 400.0), robot.kill)
    outcome = floor.run()
    floor.check()
    return floor, outcome


@pytest.mark.slow
def test_fifty_robots(clock, floor_of):
    floor, outcome = many(clock, floor_of, robots=50, orders=100, kills=0, seed=1)
    assert outcome == "succeeded"
    assert floor.stages() == {Stage.DELIVERED: 100}
    assert sum(floor.yard.given.values()) == 100
    assert len({entry.robot for entry in floor.dispatcher.book.entries.values()}) == 50
    floor.close()
    assert list_endpoints(floor.network.session()) == []


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_fifty_robots_of_which_fifteen_die(clock, floor_of, seed):
    floor, _ = many(clock, floor_of, robots=50, orders=150, kills=15, seed=seed)
    lost = sum(not robot.alive for robot in floor.robots)
    assert lost == 15
    assert floor.stages()[Stage.DELIVERED] >= 150 - 15  # one order at most went with each


@pytest.mark.parametrize("seed", range(3))
def test_some_robots_of_which_some_die(clock, floor_of, seed):
    many(clock, floor_of, robots=6, orders=15, kills=3, seed=seed)


# -- real processes --------------------------------------------------------------------------------

SMALL_SITE = """\
map: {folder}/office.yaml
robot: {folder}/office_fleet_robot.yaml
low_battery: 0.4
charge_until: 0.9
docks:
  - {{name: dock, x: 15.6, y: 7.1, yaw: 1.5708}}
homes:
  - {{name: home 0, x: 9.8, y: 7.2}}
  - {{name: home 1, x: 11.0, y: 7.2}}
places:
  - {{name: west, x: 8.0, y: 7.6}}
  - {{name: east, x: 12.5, y: 7.6}}
"""


@pytest.mark.slow
@pytest.mark.zenoh
@pytest.mark.timeout(900)
def test_two_processes_of_which_one_is_killed_on_the_way(tmp_path):
    site = tmp_path / "site.yaml"
    site.write_text(SMALL_SITE.format(folder=OFFICE_FLEET.parent))
    words = ["--robots", "2", "--orders", "2", "--lose", "1", "--site", str(site)]
    command = [
        sys.executable,
        "-c",
        "import sys; from smachpy.command import main; sys.exit(main())",
    ]
    done = subprocess.run(
        [*command, "run", "fleet", "--plain", "--out", str(tmp_path / "out"), "--", *words],
        capture_output=True,
        text=True,
        timeout=800,
        stdin=subprocess.DEVNULL,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "LOST" in done.stdout
    assert "FLEET: succeeded" in done.stdout
    assert (tmp_path / "out" / "fleet_track.png").read_bytes().startswith(b"\x89PNG")


def test_the_floor_that_robots_share_is_a_world_file(tmp_path):
    site = load_site(OFFICE_FLEET)
    team = [Robot(f"robot_{n}", home.pose) for n, home in enumerate(site.homes)]
    path = tmp_path / "world.yaml"
    path.write_text(world_text(site, team))
    world = load_world(path).build(0.0)
    assert [robot.name for robot in world.robots] == [robot.name for robot in team]
    assert len(world.docks) == len(site.docks)
    assert world.robots[3].body.pose.distance(site.homes[3].pose) < 1e-3


@pytest.mark.zenoh
@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["robot 0"], "invalid namespace: ' ' is not allowed"),
        (["robot_0", "--pose", "0", "0", "0"], "start pose: (0.00, 0.00) is in a wall"),
        (["robot_0", "--site", "nowhere.yaml"], "nowhere.yaml: got"),
    ],
)
def test_a_robot_that_cannot_be_says_why(words, text, capsys):
    assert robot_main(words) == 2
    assert text in capsys.readouterr().err


# -- the parts -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "machine",
    [
        lambda: deliver("robot_0", None, lambda: 1.0),
        lambda: recharge(lambda: 1.0),
        lambda: fleet(3, 4, start=False),
    ],
)
def test_a_check_finds_nothing(machine):
    report = check(machine())
    report.assert_ok()


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"robots": 0}, "robots: got 0; expected 1 to 12: one for each home"),
        ({"robots": 13}, "robots: got 13; expected 1 to 12"),
        ({"orders": -1}, "orders: got -1; expected 0 or more"),
        ({"robots": 2, "lose": 3}, "lose: got 3; expected 0 to 2, of 2 robots"),
        ({"lose": -1}, "lose: got -1"),
        ({"lose": 1, "together": True}, "lose: got 1 with together; expected 0"),
    ],
)
def test_bad_arguments_are_refused_before_anything_starts(arguments, text):
    with pytest.raises(MissionError, match=text):
        fleet(**arguments)


def test_a_site_that_is_wrong_says_where(tmp_path):
    text = OFFICE_FLEET.read_text().replace("office", f"{OFFICE_FLEET.parent}/office")
    path = tmp_path / "site.yaml"
    path.write_text(
        text.replace("x: 5.8, y: 7.1", "x: 0.5, y: 5.0").replace("name: lab", "name: store")
    )
    with pytest.raises(InputFileError) as caught:
        fleet(site=path)
    assert "docks[0].x: got 0.5; expected a place where the robot can stand" in str(caught.value)
    assert "places[6].name: got 'store'; expected a name that no other place has" in str(
        caught.value
    )


def test_the_office_has_room_for_the_demonstration():
    site = load_site(OFFICE_FLEET)
    assert len(site.homes) >= 8 > len(site.docks)


def test_the_same_seed_gives_the_same_orders():
    places = load_site(OFFICE_FLEET).places
    assert make_orders(places, 5, 1) == make_orders(places, 5, 1) != make_orders(places, 5, 2)
    assert all(o.pickup != o.dropoff for o in make_orders(places, 100, 3))
