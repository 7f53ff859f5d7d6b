"""Replayed traces of SUMO: places, headings, velocities in closed form."""

import re

from helpers.traffic_diagrams import TrafficDiagram
import numpy as np
import pytest

from cns_drake.traffic import EgoBox, play_trace, read_fcd
from evaluation.base import InputError

# Time step of the trace [s].
DT = 0.1
# Radius of the circle on which a vehicle drives [m].
RADIUS = 30.0
# Angular velocity of this vehicle [rad/s].
RATE = 0.2
SLOPE = 0.05
# Where pedestrians are [m].
LAWN = 0.3
EGO_BOX = EgoBox(-1.05, 3.75, 1.05)


def road_and_lawn(xy, of_road):
    """The heights of a sloped ring, and of the lawn in its middle."""
    on_ring = abs(np.hypot(*xy.T) - RADIUS) < 6.0
    if of_road:
        return np.flatnonzero(on_ring), 2.0 + SLOPE * xy[on_ring, 0]
    return np.flatnonzero(~on_ring), np.full((~on_ring).sum(), LAWN)


def no_degrees():
    raise InputError("nobody knows where the map lies")


def far_away(times):
    return np.tile((500.0, 0.0), (len(times), 1)), np.zeros(len(times))


def front_of_bus(t, length):
    """The bus's middle follows a circle; its front follows a turned one."""
    angle = RATE * t
    yaw = angle + np.pi / 2
    middle = RADIUS * np.array([np.cos(angle), np.sin(angle)])
    return middle + length / 2 * np.array([np.cos(yaw), np.sin(yaw)]), yaw


def write_trace(path, count=80, change=lambda text: text):
    """A bus on a circle, a car from 2 s to 4 s, and a walker."""
    length = 11.26
    rows = ['<?xml version="1.0"?>', "<fcd-export>"]
    for k in range(count):
        t = k * DT
        xy, yaw = front_of_bus(t, length)
        angle = (90.0 - np.degrees(yaw)) % 360.0
        rows.append(f'<timestep time="{100 + t:.2f}">')
        rows.append(
            f'<vehicle id="b" x="{xy[0]:.6f}" y="{xy[1]:.6f}" '
            f'angle="{angle:.6f}" type="city_bus" speed="6" slope="2"/>'
        )
        if 20 <= k <= 40:
            rows.append(
                f'<vehicle id="c" x="{-RADIUS}" y="{7 * t - 20:.6f}" '
                'angle="0" type="DEFAULT_VEHTYPE" speed="7" pos="1" '
                'lane="e_0"/>'
            )
        rows.append(
            f'<person id="p" x="{20 - 1.25 * t:.6f}" y="3" angle="270" '
            'speed="1.25" pos="1" edge="e"/>'
        )
        rows.append("</timestep>")
    rows.append("</fcd-export>")
    path.write_text(change("\n".join(rows)))
    return path


def play(
    path, duration=7.0, ego=far_away, seed=1, end=7.0, levels=road_and_lawn,
    from_degrees=no_degrees,
):  # fmt: skip
    return play_trace(
        read_fcd(path, from_degrees), path, levels, seed=seed,
        duration=duration, end=end, ego=ego, ego_box=EGO_BOX,
    )  # fmt: skip


@pytest.fixture
def trace(tmp_path):
    return write_trace(tmp_path / "trace.xml")


def test_places_and_velocities(trace):
    plan = play(trace)
    assert plan.kinds[0].name == "bus"
    assert plan.kinds[1].semantic_class == "car"
    assert plan.left_out == 0
    for t in (0.0, 0.1 - 1e-9, 0.1, 1.234, 3.05, 5.5, 6.999, 7.9):
        (values, rates) = plan.vehicles.at(t)
        angle = RATE * t
        expected = RADIUS * np.array([np.cos(angle), np.sin(angle)])
        np.testing.assert_allclose(values[0, :2], expected, atol=1e-5)
        np.testing.assert_allclose(
            rates[0, :2],
            RATE * RADIUS * np.array([-np.sin(angle), np.cos(angle)]),
            atol=2e-3,
        )
        assert values[0, 3] == pytest.approx(angle + np.pi / 2, abs=1e-6)
        assert rates[0, 3] == pytest.approx(RATE, abs=1e-6)
        # Uphill is nose up, which is a turn about -y.
        assert values[0, 4] == pytest.approx(-np.radians(2.0))
        height = 2.0 + SLOPE * expected[0]
        assert values[0, 2] == pytest.approx(height, abs=1e-4)
        walkers, walker_rates = plan.walkers.at(t)
        np.testing.assert_allclose(walkers[0, :2], [20 - 1.25 * t, 3.0])
        assert abs(walkers[0, 3]) == pytest.approx(np.pi)
        np.testing.assert_allclose(walker_rates[0, :2], [-1.25, 0], atol=1e-9)
        assert walkers[0, 2] == LAWN
        stride = 0.7 * 1.25 + 0.4
        assert walker_rates[0, 4] == pytest.approx(2 * np.pi * 1.25 / stride)


def test_velocities_are_continuous(trace):
    plan = play(trace)
    for knot in DT * np.arange(1, 70):
        before, after = (
            plan.vehicles.at(knot + sign * 1e-9)[1] for sign in (-1, 1)
        )
        there = plan.vehicles.is_present(knot - 1e-6)
        there &= plan.vehicles.is_present(knot + 1e-6)
        np.testing.assert_allclose(before[there], after[there], atol=1e-5)


def test_objects_that_come_and_go(trace):
    plan = play(trace)
    for t, there in ((1.95, False), (2.05, True), (3.95, True), (4.05, False)):
        assert plan.vehicles.is_present(t).tolist() == [True, there]
    values, rates = plan.vehicles.at(3.05)
    half = plan.kinds[1].size[0] / 2
    expected = [-RADIUS, 7 * 3.05 - 20 - half]
    np.testing.assert_allclose(values[1, :2], expected, atol=1e-9)
    np.testing.assert_allclose(rates[1, :2], [0.0, 7.0], atol=1e-9)


def test_the_same_trace_gives_the_same_plan(trace):
    one, other = play(trace), play(trace)
    np.testing.assert_array_equal(one.vehicles.values, other.vehicles.values)
    assert one.kinds == other.kinds
    kinds = {play(trace, seed=seed).kinds[1].name for seed in range(20)}
    assert len(kinds) > 2


def test_walkers_do_not_walk_in_step(tmp_path):
    """Each begins at its own place of the gait, in the first frame too."""

    def add(text):
        one = re.search(r'<person id="p" .*?/>', text)[0].partition(" x=")[2]
        others = "".join(f'<person id="q{k}" x={one}' for k in range(9))
        return text.replace("</timestep>", others + "</timestep>")

    plan = play(write_trace(tmp_path / "many.xml", change=add))
    for t in (0.0, 3.3):
        phases = plan.walkers.at(t)[0][:, 4] % (2 * np.pi)
        assert len(np.unique(phases.round(2))) > 7
        assert np.ptp(np.sin(phases)) > 1.0


def at_four(times):
    """The ego car stands where the traced car passes at about 3.5 s."""
    return np.tile((-RADIUS, 4.0), (len(times), 1)), np.zeros(len(times))


def test_objects_are_absent_while_they_would_meet_the_ego_car(trace):
    plan, free = play(trace, ego=at_four), play(trace)
    assert [kind.name for kind in plan.kinds] == ["bus", "hatchback"]
    assert plan.notes == (
        *free.notes,
        "traffic: 1 left out while they would meet the car",
    )
    times = np.arange(0.0, 7.0, 0.02)
    there, before = (p.vehicles.is_present(times) for p in (plan, free))
    np.testing.assert_array_equal(there[:, 0], before[:, 0])
    # The car's front is at 7 t - 20; the ego car is 2.1 m wide there.
    y, _ = np.moveaxis(free.vehicles.at(times)[0][:, 1, 1:3], -1, 0)
    half = plan.kinds[1].size[0] / 2
    is_over = before[:, 1] & (np.abs(y - 4.0) < half + 1.05)
    assert is_over.any()
    assert not (there[:, 1] & is_over).any()
    # It is away for as long as needed, and at most 0.1 s and 2 steps longer.
    gone = times[before[:, 1] & ~there[:, 1]]
    assert times[is_over].min() - gone.min() <= 0.1 + 2 * DT
    assert gone.min() <= times[is_over].min() - 0.1
    assert there[:, 1].any()


def test_what_meets_the_ego_car_after_its_drive_stays(trace):
    # The traced car is there from 2 s on, and at the ego car after 3 s.
    notes = [
        play(trace, ego=at_four, duration=2.5, end=end).notes
        for end in (2.5, 3.5)
    ]
    assert len(notes[0]) + 1 == len(notes[1])


@pytest.mark.parametrize("acceleration", [0.0, -3.0])
@pytest.mark.parametrize("dt", [0.1, 1.0])
def test_a_constant_acceleration_is_exact_from_first_to_last(
    tmp_path, dt, acceleration
):
    """A car on a straight lane, at first at 10 m/s."""

    def front(t):
        return 10.0 * t + acceleration / 2 * t**2 - 20.0

    path = write_moves(
        tmp_path / "a.xml", "vehicle", "", dt, [front(k * dt) for k in range(5)]
    )
    plan = play(path, duration=4 * dt, end=0.0)
    half = plan.kinds[0].size[0] / 2
    for t in np.linspace(0.0, 4 * dt, 37):
        place, rate = (one[0] for one in plan.vehicles.at(t))
        np.testing.assert_allclose(
            place[:2], [front(t) - half, -RADIUS], atol=1e-9
        )
        speed = 10.0 + acceleration * t
        np.testing.assert_allclose(rate[:2], [speed, 0.0], atol=1e-9)
    # It goes straight on.
    later, _ = plan.vehicles.at(4 * dt + 0.05)
    assert later[0, 0] == pytest.approx(place[0] + 0.05 * rate[0])


def test_a_lidar_that_turns_sees_bodies_come_and_go_in_motion(trace):
    """The traced car is there from 2 s to 4 s, at 7 m/s."""
    plan = play(trace)
    diagram = TrafficDiagram(plan, turn=0.05)
    for t in (2.001, 3.0, 3.97, 3.999):
        velocities = diagram.output("body_spatial_velocities", t)
        velocity = velocities[1].translational()
        np.testing.assert_allclose(velocity[:2], [0, 7], atol=1e-6)
        assert abs(velocity[2]) < 1e-6


def fault(path, **options):
    with pytest.raises(InputError) as error:
        play(path, **options)
    assert "\n" not in str(error.value)
    assert str(error.value).startswith(f"{path}: ")
    return str(error.value)[len(f"{path}: ") :]


def write_moves(path, tag, kind, dt, xs):
    """A trace of one body that moves along x; None where it is absent."""
    rows = "".join(
        f'<timestep time="{k * dt:.2f}">'
        + (
            ""
            if x is None
            else f'<{tag} id="a" x="{x}" y="{-RADIUS}" angle="90" type="{kind}"'
            ' speed="1"/>'
        )
        + f'<vehicle id="b" x="{-k * dt}" y="{RADIUS}" angle="270"/></timestep>'
        for k, x in enumerate(xs)
    )
    path.write_text(f"<fcd-export>{rows}</fcd-export>")
    return path


@pytest.mark.parametrize(
    ("tag", "kind", "fastest"),
    [
        ("vehicle", "passenger", 80.0),
        ("vehicle", "DEFAULT_BIKETYPE", 20.0),
        ("vehicle", "bikeFast", 20.0),
        ("vehicle", "motorbike", 80.0),
        ("vehicle", "city_bus", 80.0),
        ("person", "DEFAULT_PEDTYPE", 12.0),
    ],
)
@pytest.mark.parametrize("dt", [0.1, 1.0])
def test_what_jumps_is_absent_meanwhile(tmp_path, tag, kind, fastest, dt):
    """SUMO teleports vehicles; nobody flies through the city at that speed."""
    for factor, jumps in ((0.999, 0), (1.001, 1)):
        far = factor * fastest * dt
        xs = [0.0, 0.1, 0.2, 0.2 + far, 0.3 + far, 0.4 + far]
        path = write_moves(tmp_path / "a.xml", tag, kind, dt, xs)
        trace = read_fcd(path, no_degrees)
        plan = play(path, duration=5 * dt, end=5 * dt)
        tracks = plan.vehicles if tag == "vehicle" else plan.walkers
        own = [0, 1][: 1 + jumps]
        for k in range(5):
            t = (k + 0.5) * dt
            there = tracks.is_present(t)[own]
            assert there.sum() == (0 if jumps and k == 2 else 1)
            speed = np.abs(tracks.at(t)[1][own, 0][there])
            if jumps:
                np.testing.assert_allclose(speed, 0.1 / dt, rtol=1e-6)
        if not jumps:
            assert trace.notes == ()
            continue
        (note,) = trace.notes
        assert note.startswith(
            f"{path}: left out: 1 jumps from one timestep to the next, such as"
            f" that of 'a' at {3 * dt:g} s, by "
        )
        # It stays the same kind of body.
        assert tag == "person" or plan.kinds[0] == plan.kinds[1]


def test_a_trace_of_jumps_has_other_units(tmp_path):
    xs = [1000.0 * k for k in range(1002)]
    path = write_moves(tmp_path / "a.xml", "vehicle", "", 1.0, xs[:-1])
    assert len(read_fcd(path, no_degrees).vehicles) == 1001 + 1
    path = write_moves(tmp_path / "a.xml", "vehicle", "", 1.0, xs)
    with pytest.raises(InputError, match=r"1001 jumps from .* in seconds"):
        read_fcd(path, no_degrees)


@pytest.mark.parametrize("tag", ["vehicle", "person"])
@pytest.mark.parametrize(
    ("metres", "is_refused"),
    [(1.0, False), (1.2, False), (0.3048, True), (1000.0, True)],
)
def test_speeds_tell_the_unit_of_places(tmp_path, tag, metres, is_refused):
    rows = "".join(
        f'<timestep time="{k * DT:.1f}"><{tag} id="a" speed="2" angle="90"'
        f' x="{9 + 2 * k * DT / metres:.9f}" y="47"/></timestep>'
        for k in range(80)
    )
    path = tmp_path / "x.xml"
    path.write_text(f"<fcd-export>{rows}</fcd-export>")
    if is_refused:
        with pytest.raises(InputError, match=r"x\.xml: the places are not in"):
            read_fcd(path, no_degrees)
    else:
        assert not read_fcd(path, no_degrees).notes


def test_what_is_away_for_a_time_may_come_back_elsewhere(tmp_path):
    xs = [0.0, 3.0, None, None, 500.0, 503.0]
    path = write_moves(tmp_path / "a.xml", "vehicle", "passenger", 1.0, xs)
    assert read_fcd(path, no_degrees).notes == ()
    tracks = play(path, duration=5.0, end=5.0).vehicles
    there = [bool(tracks.is_present(k + 0.5)[0]) for k in range(5)]
    assert there == [True, False, False, False, True]
    for t in (0.01, 0.99, 4.01, 4.99):
        assert tracks.at(t)[1][0, 0] == pytest.approx(3.0)


def test_a_trace_that_is_too_short(trace):
    play(trace, duration=7.9)
    assert fault(trace, duration=7.91) == (
        "the trace has 7.9 s from 100 s on, but the drive takes 7.91 s: record"
        " more, or lower frames"
    )


@pytest.mark.parametrize(
    ("offset", "ground", "place"),
    [(12.0, "roads", r"x -1\d to 4\d"), (900.0, "ground", r"x 8\d\d to 9\d\d")],
)
def test_a_trace_of_another_map(tmp_path, offset, ground, place):
    def move(text):
        return re.sub(
            r' x="([^"]+)"', lambda m: f' x="{float(m[1]) + offset}"', text
        )

    def levels(xy, of_road):
        found, z = road_and_lawn(xy, of_road)
        near = np.hypot(*xy[found].T) < 50.0
        return found[near], z[near]

    path = write_trace(tmp_path / "moved.xml", change=move)
    assert re.fullmatch(
        rf"half of the trace is beside the map's {ground}: it is at {place}, "
        r"y .* m; give a trace of this map, without an offset",
        fault(path, levels=levels),
    )


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('time="103.00"', 'time="103.05"', "timestep 103.05: times are not ev"),
        ('time="103.00"', 'time="x"', "line .*: timestep: time: 'x' is no num"),
        ('angle="0" ', "", "line .*: vehicle: no angle"),
        ('id="c"', 'id="b"', "line .*: vehicle 'b' is there twice"),
        ("</fcd-export>", "", "cannot be parsed: line .*: no element found"),
        ("fcd-export", "sumo", "line 2: sumo is no fcd-export"),
        ("vehicle|person", "container", "the trace has no vehicle"),
        ("<fcd-export>", '<!DOCTYPE a [<!ENTITY b "c">]><fcd-export>', "line"),
    ],
)
def test_traces_that_are_none(tmp_path, old, new, expected):
    path = write_trace(
        tmp_path / "bad.xml", change=lambda text: re.sub(old, new, text)
    )
    assert re.match(expected, fault(path))


@pytest.mark.parametrize("vehicle", ["", ' vehicle="b"'])
def test_persons_are_not_seen_while_they_ride(tmp_path, vehicle):
    """Walker p boards the bus at 3 s and leaves it at 5 s; q rides throughout.

    A container rides, too.
    """
    number = iter(range(80))

    def boards(match):
        k = next(number)
        x, y = re.search(r'id="b" x="(\S+)" y="(\S+)"', match[0]).groups()
        row = '<person id="{}" x="{}" y="{}" angle="0" speed="6"{}/>'
        rider = row.format("q", x, y, vehicle)
        if 30 <= k <= 50:
            own = row.format("p", x, y, vehicle)
            match = re.sub(r'<person id="p".*?/>', own, match[0])
        else:
            match = match[0]
        load = f'<container id="load" x="{x}" y="{y}" angle="0"/>'
        return match.replace("</timestep>", f"{rider}{load}</timestep>")

    def change(text):
        return re.sub(r"<timestep.*?</timestep>", boards, text, flags=re.DOTALL)

    path = write_trace(tmp_path / "trace.xml", change=change)
    plan = play(path)
    for t, there in ((2.85, True), (3.05, False), (4.95, False), (5.15, True)):
        assert plan.walkers.is_present(t).tolist() == [there]
        assert plan.vehicles.is_present(t)[0]
    values, _ = plan.walkers.at(5.15)
    np.testing.assert_allclose(values[0, :2], [20 - 1.25 * 5.15, 3.0])
    assert plan.notes == (
        f"{path}: left out: 2 persons, while they ride in vehicles",
        f"{path}: left out: 1 elements container",
    )


ABOVE = 6.0


def bridge(xy, of_road):
    """A bridge towards the north over a street towards the east."""
    if not of_road:
        return np.zeros(0, int), np.zeros(0)
    over, under = abs(xy[:, 0] + 1.75) < 3.0, abs(xy[:, 1] - 1.75) < 3.0
    return np.concatenate([np.flatnonzero(over), np.flatnonzero(under)]), (
        np.repeat([ABOVE, 0.0], [over.sum(), under.sum()])
    )


def stacked(xy, of_road):
    """A street on two levels, one above the other."""
    both = np.arange(len(xy) * of_road)
    return np.tile(both, 2), np.repeat([0.0, ABOVE], len(both))


@pytest.mark.parametrize("zero", [None, 0.0, -40.0])
@pytest.mark.parametrize(
    ("levels", "starts", "heights"),
    [
        (bridge, ((-1.75, -50, 0, 8), (-50, 1.75, 8, 0)), (ABOVE, 0)),
        (stacked, ((-50, 1.75, 8, 0), (50, 1.75, -8, 0)), (0, ABOVE)),
    ],
)
def test_vehicles_are_on_their_own_level(
    tmp_path, zero, levels, starts, heights
):
    """Over a crossing on two levels; the trace has heights, or none."""
    if zero is None and levels is stacked:
        pytest.skip("nothing tells the level")
    steps = []
    for k in range(120):
        rows = [f'<timestep time="{k / 10}">']
        for name, (x, y, u, v), z in zip("ab", starts, heights, strict=True):
            place = f'x="{x + u * k / 10}" y="{y + v * k / 10}"'
            if zero is not None:
                place += f' z="{z + zero}"'
            angle = np.degrees(np.arctan2(u, v))
            rows.append(f'<vehicle id="{name}" {place} angle="{angle}"/>')
        steps.append("".join([*rows, "</timestep>"]))
    path = tmp_path / "trace.xml"
    path.write_text(f"<fcd-export>{''.join(steps)}</fcd-export>")
    plan = play(path, duration=10.0, end=10.0, levels=levels)
    for t in np.arange(0.0, 10.0, 0.1):
        values, _ = plan.vehicles.at(t)
        np.testing.assert_allclose(values[:, 2], heights, atol=1e-6)


def test_a_walker_stays_on_the_bridge_on_which_he_came(tmp_path):
    rows = [
        f'<timestep time="{k}">'
        f'<person id="p" x="-1.75" y="{k - 30}" angle="0"/>'
        "</timestep>"
        for k in range(60)
    ]
    path = tmp_path / "trace.xml"
    path.write_text(f"<fcd-export>{''.join(rows)}</fcd-export>")
    plan = play(path, duration=50.0, end=50.0, levels=bridge)
    heights = [plan.walkers.at(t)[0][0, 2] for t in np.arange(0.0, 50.0)]
    np.testing.assert_allclose(heights, ABOVE, atol=1e-6)


def test_road_users_stay_at_their_height_beside_the_ground(trace):
    """The ground ends in the east, where the bus begins."""

    def cut(xy, of_road):
        place, z = road_and_lawn(xy, of_road)
        kept = xy[place, 0] < 20.0
        return place[kept], z[kept]

    tracks = play(trace, levels=cut).vehicles
    # From here on the bus is on the ground.
    first = np.flatnonzero(tracks.values[:, 0, 0] < 20.0)[0]
    edge = 2.0 + SLOPE * tracks.values[first, 0, 0]
    np.testing.assert_allclose(tracks.values[: first + 1, 0, 2], edge)
    assert first > 5


# Longitude and latitude of the map's origin [deg].
EAST = 13.44
NORTH = 52.47
# Metres per degree there.
METRES = np.array([68_000.0, 111_260.0])


def in_degrees(text, turn_deg):
    """A trace in degrees, of a projection that is turned to the map's."""

    def place(match):
        x, y = (float(match[k]) for k in (1, 2))
        longitude, latitude = x / METRES[0] + EAST, y / METRES[1] + NORTH
        return f' x="{longitude:.9f}" y="{latitude:.9f}"'

    def angle(match):
        return f' angle="{float(match[1]) + turn_deg:.6f}"'

    text = re.sub(r' x="(\S+)" y="(\S+)"', place, text)
    return re.sub(r' angle="(\S+)"', angle, text)


def test_a_trace_in_degrees(tmp_path, trace):
    """With a person who rides in the bus, and a projection of its own."""

    def with_rider(text):
        return re.sub(
            r'(id="b" (x="\S+" y="\S+").*?/>)',
            r'\1<person id="r" \2 angle="0" speed="6"/>',
            text,
        )

    metres = write_trace(tmp_path / "metres.xml", change=with_rider)
    degrees = write_trace(
        tmp_path / "degrees.xml",
        change=lambda text: in_degrees(with_rider(text), 1.3),
    )

    def from_degrees():
        return lambda places: (places - (EAST, NORTH)) * METRES

    expected = play(metres)
    found = play(degrees, from_degrees=from_degrees)
    assert [one.name for one in found.kinds] == [
        one.name for one in expected.kinds
    ]
    for one, other in (
        (found.vehicles, expected.vehicles),
        (found.walkers, expected.walkers),
    ):
        np.testing.assert_array_equal(one.present, other.present)
        np.testing.assert_allclose(one.values, other.values, atol=5e-3)
    assert found.notes[0].endswith("1 persons, while they ride in vehicles")
    assert fault(degrees) == (
        "its places are longitudes and latitudes: nobody knows where the map"
        " lies"
    )
