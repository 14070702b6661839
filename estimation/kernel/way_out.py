"""The first pass, from the base to the leaves: where links are, and what concerns one link alone.

The same as `tree_kinematics` and `problem` do for whole batches with numpy.
"""

from typing import Any

from estimation.kernel.block_products import Blocks
from estimation.kernel.layout import (
    GLOBAL,
    LINK_ROW,
    PLATE_ROW,
    PLATE_ROW_SIZE,
    SENSOR_ROW,
    SENSOR_ROW_SIZE,
    columns,
)
from estimation.kernel.stage import Stage
from estimation.kernel.vector_code import Value, constant, splat

THREE = range(3)


def _column(stage: Stage, name: str) -> Value:
    """Returns the column of a part of the state."""
    plain, _ = columns(0)
    per_dof, _ = columns(1)
    times = per_dof[name] - plain[name]
    start = stage.builder.mul(stage.setting("n_dof"), constant(times))
    return stage.builder.add(constant(plain[name]), start)


def write_base(blocks: Blocks) -> Any:
    """Writes the stage that reads the base's place, axes and angular velocity."""
    stage = Stage(blocks, "base")
    for name in ("position", "omega"):
        stage.copy(stage.block(name), stage.own(_column(stage, name)), 3)
    x, y, z, w = stage.loads(stage.own(_column(stage, "quaternion")), 4)
    two = splat(2.0)
    # Rows of the matrix of a unit quaternion.
    for i, (p, q, r) in enumerate(((x, y, z), (y, z, x), (z, x, y))):
        j, k = (i + 1) % 3, (i + 2) % 3
        square = stage.add(stage.times(q, q), stage.times(r, r))
        diagonal = stage.subtract(splat(1.0), stage.times(two, square))
        right = stage.subtract(stage.times(p, q), stage.times(r, w))
        left = stage.add(stage.times(p, r), stage.times(q, w))
        stage.store(diagonal, stage.block("rotation"), 3 * i + i)
        stage.store(stage.times(two, right), stage.block("rotation"), 3 * i + j)
        stage.store(stage.times(two, left), stage.block("rotation"), 3 * i + k)
    return stage.done()


def write_place(blocks: Blocks) -> Any:
    """Writes the stage that places a link after its parent, and finds what velocities do to it."""
    stage = Stage(blocks, "place")
    parent = stage.of_link("parent")
    turn, h, omega = (stage.block(name) for name in ("turn", "h", "omega"))
    # The joint's columns, three at most, and its share of the bias.
    stage.fill(splat(0.0), h, 9)
    beta = stage.at(stage.block("b"), 3)
    stage.fill(splat(0.0), stage.block("b"), 6)
    stage.fill(splat(0.0), turn, 9)
    for i in THREE:
        stage.store(splat(1.0), turn, 4 * i)
    above = stage.block("omega", parent)
    stage.copy(omega, above, 3)
    stage.fill(splat(0.0), stage.block("s_hat"), 3)
    stage.fill(splat(1.0), stage.block("variance"), 3)
    with stage.loop(0, stage.of_link("axes")) as place:
        _turn_about_axis(stage, place, [omega, beta, h, turn])
    stage.spread_all(stage.link_constant("offset"), stage.block("offset"), 3)
    _chain(stage, parent)
    return stage.done()


def _turn_about_axis(stage: Stage, place: Value, parts: list[Value]) -> None:
    """One axis of a joint: everything so far is expressed in the axes after it."""
    builder = stage.builder
    omega, beta, h, turn = parts
    axis = stage.whole(stage.row, builder.add(place, constant(LINK_ROW["axis"])))
    dof = stage.whole(stage.row, builder.add(place, constant(LINK_ROW["dof"])))
    sine, cosine, rate = (
        stage.load(stage.own(builder.add(_column(stage, name), dof)))
        for name in ("sine", "cosine", "rate")
    )
    mean = builder.sub(constant(-1), stage.setting("joint_mean"))
    s_hat = stage.load(stage.own(builder.add(mean, dof)))
    stage.store(s_hat, stage.block("s_hat"), place)
    first = stage.setting("joint_variance")
    own = builder.icmp_signed("<", first, constant(0))
    reference = builder.select(own, builder.sub(first, dof), builder.add(first, dof))
    stage.fetch(stage.at(stage.block("variance"), place), reference, 1)
    left = builder.srem(builder.add(axis, constant(1)), constant(3))
    right = builder.srem(builder.add(axis, constant(2)), constant(3))
    vectors = [omega, beta]
    vectors += [stage.at(h, 3 * i) for i in THREE] + [stage.at(turn, 3 * i) for i in THREE]
    for vector in vectors:
        a, b = stage.load(vector, left), stage.load(vector, right)
        stage.store(stage.dot([cosine, sine], [a, b]), vector, left)
        stage.store(stage.subtract(stage.times(cosine, b), stage.times(sine, a)), vector, right)
    stage.store(stage.add(stage.load(omega, axis), rate), omega, axis)
    # omega x (axis * rate), of which omega's own part along the axis drops out.
    more = stage.times(stage.load(omega, right), rate)
    less = stage.times(stage.load(omega, left), rate)
    stage.store(stage.add(stage.load(beta, left), more), beta, left)
    stage.store(stage.subtract(stage.load(beta, right), less), beta, right)
    column = builder.add(builder.mul(place, constant(3)), axis)
    stage.store(splat(1.0), h, column)


def _chain(stage: Stage, parent: Value) -> None:
    """The link's axes and place in the world, and the bias of its origin."""
    turn = stage.block("turn")
    T = [stage.loads(turn, 3, 3 * i) for i in THREE]
    offset = stage.loads(stage.block("offset"), 3)
    above = stage.block("rotation", parent)
    R = [stage.loads(above, 3, 3 * i) for i in THREE]
    for i in THREE:
        for j in THREE:
            value = stage.dot(R[i], [T[k][j] for k in THREE])
            stage.store(value, stage.block("rotation"), 3 * i + j)
        start = stage.load(stage.block("position", parent), i)
        stage.store(stage.dot(R[i], offset, start), stage.block("position"), i)
    w = stage.loads(stage.block("omega", parent), 3)
    centripetal = stage.cross(w, stage.cross(w, offset))
    for i in THREE:
        column = [T[k][i] for k in THREE]
        stage.store(stage.dot(column, centripetal), stage.block("b"), i)
    # The whole of what is expected of the acceleration relative to the parent.
    s_hat = stage.loads(stage.block("s_hat"), 3)
    for i in THREE:
        axes = [stage.load(stage.block("h"), 3 * k + i) for k in THREE]
        rest = stage.load(stage.block("b"), 3 + i)
        stage.store(stage.dot(axes, s_hat, rest), stage.block("b"), 3 + i)


def write_terms(blocks: Blocks) -> Any:
    """Writes the stage that folds a link's own sensors, inertia and model noise into it."""
    stage = Stage(blocks, "terms")
    stage.fetch(stage.block("J"), stage.of_link("information"), 36)
    zero = stage.spread(stage.real(stage.table("constants"), GLOBAL["information_mean"]))
    stage.fill(zero, stage.block("j"), 6)
    with stage.loop(stage.of_link("first_sensor"), stage.of_link("last_sensor")) as sensor:
        _motion_sensor(stage, sensor)
    Px, fbar = stage.block("Px"), stage.block("fbar")
    stage.fetch(Px, stage.of_link("wrench_covariance"), 36)
    stage.fetch(fbar, stage.of_link("wrench"), 6)
    with stage.loop(stage.of_link("first_plate"), stage.of_link("last_plate")) as plate:
        _plate(stage, plate)
    with stage.when(stage.setting("prior_on_wrenches")):
        _wrench_prior(stage)
    M, S0, k = stage.block("M"), stage.block("S0"), stage.block("k")
    stage.spread_all(stage.link_constant("inertia"), M, 36)
    noise = stage.link_constant("dynamics")
    with stage.loop(0, 36) as slot:
        here = stage.spread(stage.real(noise, slot))
        stage.store(stage.add(here, stage.load(Px, slot)), S0, slot)
    w = stage.loads(stage.block("omega"), 3)
    momentum = [stage.dot(stage.loads(M, 3, 6 * i + 3), w) for i in range(6)]
    gyro = stage.cross(w, momentum[:3]) + stage.cross(w, momentum[3:])
    for i in range(6):
        stage.store(stage.subtract(gyro[i], stage.load(fbar, i)), k, i)
    return stage.done()


def _motion_sensor(stage: Stage, sensor: Value) -> None:
    """Adds what an accelerometer tells, less what the link's turning alone would make it read."""
    row = stage.address("motion_sensors", sensor, SENSOR_ROW_SIZE)
    weight, spun = stage.common("block0"), stage.common("block1")
    place, value = stage.common("vector0"), stage.common("vector1")
    for name, out, count in (
        ("weight", weight, 18),
        ("centripetal", spun, 18),
        ("position", place, 3),
        ("value", value, 3),
    ):
        stage.fetch(out, stage.whole(row, SENSOR_ROW[name]), count)
    w, y = stage.loads(stage.block("omega"), 3), stage.loads(value, 3)
    turning = stage.cross(w, stage.cross(w, stage.loads(place, 3)))
    j = stage.block("j")
    for i in range(6):
        total = stage.dot(stage.loads(weight, 3, 3 * i), y, stage.load(j, i))
        less = stage.dot(stage.loads(spun, 3, 3 * i), turning)
        stage.store(stage.subtract(total, less), j, i)


def _plate(stage: Stage, plate: Value) -> None:
    """Adds what a plate in the world measures, carried to the link."""
    row = stage.address("plates", plate, PLATE_ROW_SIZE)
    axes, place = stage.common("vector0"), stage.common("vector1")
    value, noise = stage.common("vector2"), stage.common("block0")
    for name, out, count in (
        ("rotation", axes, 9),
        ("position", place, 3),
        ("covariance", noise, 36),
        ("wrench", value, 6),
    ):
        stage.fetch(out, stage.whole(row, PLATE_ROW[name]), count)
    # Into the link's axes, from its origin.
    R = [stage.loads(stage.block("rotation"), 3, 3 * i) for i in THREE]
    position = stage.block("position")
    away = [stage.subtract(stage.load(place, i), stage.load(position, i)) for i in THREE]
    given = [stage.loads(axes, 3, 3 * i) for i in THREE]
    for i in THREE:
        back = [R[k][i] for k in THREE]
        for j in THREE:
            stage.store(stage.dot(back, [given[k][j] for k in THREE]), axes, 3 * i + j)
        stage.store(stage.dot(back, away), place, i)
    stage.blocks.wrench_up(stage, stage.block("fbar"), value, axes, place)
    stage.blocks.carry_up(stage, stage.block("Px"), noise, axes, place, symmetric=True)


def _wrench_prior(stage: Stage) -> None:
    """Combines a link's measured wrench with the prior of all wrenches."""
    Px, fbar = stage.block("Px"), stage.block("fbar")
    weight, vector = stage.common("block0"), stage.common("vector0")
    constants = stage.table("constants")
    stage.blocks.inverse(stage, weight, Px, stage.common("least"))
    stage.blocks.vector_product(stage, vector, weight, fbar)
    more = stage.spread(stage.real(constants, GLOBAL["wrench_information"]))
    pull = stage.spread(stage.real(constants, GLOBAL["wrench_pull"]))
    for i in range(6):
        stage.store(stage.add(stage.load(weight, 7 * i), more), weight, 7 * i)
        stage.store(stage.add(stage.load(vector, i), pull), vector, i)
    stage.blocks.inverse(stage, Px, weight, stage.common("least"))
    stage.blocks.vector_product(stage, fbar, Px, vector)
