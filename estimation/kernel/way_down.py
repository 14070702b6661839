"""The third pass, from the base to the leaves: means, covariances, and what of them goes out.

The recursion is that of `elimination.sweep_down` and `sweep_down_spreads`, in the child's axes.
"""

from typing import Any

from estimation.kernel.block_products import SIX, Blocks
from estimation.kernel.layout import LINK_ROW
from estimation.kernel.stage import Stage
from estimation.kernel.vector_code import Value, constant, splat

THREE = range(3)


def write_means(blocks: Blocks) -> Any:
    """Writes the stage that gives a link and the joint above it their posterior means."""
    stage = Stage(blocks, "means")
    parent = stage.of_link("parent")
    a, z, b = stage.block("a"), stage.block("z"), stage.block("b")
    above_a, above_z = stage.common("vector0"), stage.common("vector1")
    column = stage.builder.mul(stage.builder.sub(stage.link, constant(1)), constant(6))
    fj = stage.output("joint_wrench", column)
    axes = (stage.block("turn"), stage.block("offset"))
    blocks.motion_down(stage, above_a, stage.block("a", parent), *axes)
    blocks.motion_down(stage, above_z, stage.block("z", parent), *axes)
    K, Pf = _wrench_gains(stage)
    stage.copy(fj, stage.block("k"), 6)
    blocks.vector_product(stage, fj, K, above_a, add=True)
    blocks.vector_product(stage, fj, Pf, above_z, add=True)
    stage.copy(z, above_z, 6)
    with stage.when(stage.setting("prior_on_joint_wrenches")):
        pull = stage.common("vector3")
        stage.copy(z, stage.block("u0"), 6)
        blocks.vector_product(stage, z, stage.block("through"), above_z, add=True)
        blocks.vector_product(stage, pull, stage.block("U"), above_a)
        for i in SIX:
            stage.store(stage.subtract(stage.load(z, i), stage.load(pull, i)), z, i)
    stage.copy(a, stage.block("e"), 6)
    blocks.vector_product(stage, a, stage.block("A"), above_a, add=True)
    blocks.vector_product(stage, a, stage.block("G"), z, add=True)
    rest = []
    for i in SIX:
        more = stage.add(stage.load(above_a, i), stage.load(b, i))
        rest.append(stage.subtract(stage.load(a, i), more))
    moment = stage.loads(fj, 3, 3)
    found, torque = stage.common("vector3"), stage.common("vector4")
    for axis in THREE:
        gain = stage.loads(stage.block("r"), 6, 6 * axis)
        expected = stage.load(stage.block("s_hat"), axis)
        stage.store(stage.dot(gain, rest, expected), found, axis)
        h = stage.loads(stage.block("h"), 3, 3 * axis)
        stage.store(stage.dot(h, moment), torque, axis)
    _put_dofs(stage, "joint_acceleration", found)
    _put_dofs(stage, "torque", torque)
    return stage.done()


def _wrench_gains(stage: Stage) -> tuple[Value, Value]:
    """Where the joint wrench's gain and covariance are, with a prior on it and without."""
    builder, prior = stage.builder, _pulled(stage)
    K = builder.select(prior, stage.block("K"), stage.block("MA"))
    return K, builder.select(prior, stage.block("Pf"), stage.block("S0"))


def _pulled(stage: Stage) -> Value:
    """Whether there is a prior on joint wrenches."""
    setting = stage.setting("prior_on_joint_wrenches")
    return stage.builder.icmp_signed("!=", setting, constant(0))


def _put_dofs(stage: Stage, table: str, block: Value) -> None:
    with stage.loop(0, stage.of_link("axes")) as place:
        dof = stage.whole(stage.row, stage.builder.add(place, constant(LINK_ROW["dof"])))
        stage.store(stage.load(block, place), stage.output(table, dof))


def write_link_out(blocks: Blocks) -> Any:
    """Writes the stage that puts out what every link has, the base too."""
    stage = Stage(blocks, "link_out")
    column = stage.builder.mul(stage.link, constant(6))
    fx = stage.output("external_wrench", column)
    blocks.vector_product(stage, fx, stage.block("Px"), stage.block("z"))
    for i in SIX:
        external = stage.subtract(stage.load(stage.block("fbar"), i), stage.load(fx, i))
        stage.store(external, fx, i)
    stage.copy(stage.output("link_acceleration", column), stage.block("a"), 6)
    axes = stage.builder.mul(stage.link, constant(9))
    stage.copy(stage.output("link_rotation", axes), stage.block("rotation"), 9)
    with stage.when(stage.setting("spreads")):
        half, other, Px = stage.common("block0"), stage.common("block1"), stage.block("Px")
        variances = [stage.load(stage.block("Ca"), 7 * i) for i in SIX]
        stage.standard_deviations(stage.output("link_acceleration_sd", column), variances)
        with stage.builder.if_else(_pulled(stage)) as (pulled, free):
            with pulled:
                blocks.product(stage, half, Px, stage.block("B"))
                stage.copy(other, Px, 36)
            with free:
                # Their difference keeps its digits where a force is all but free.
                blocks.product(stage, other, Px, stage.block("F"))
                blocks.product(stage, half, Px, stage.block("F"), minus=True)
        rows = [stage.loads(half, 6, 6 * i) for i in SIX]
        own = [stage.loads(other, 6, 6 * i) for i in SIX]
        variances = [stage.dot(rows[i], own[i], stage.load(Px, 7 * i)) for i in SIX]
        stage.standard_deviations(stage.output("external_wrench_sd", column), variances)
    return stage.done()


def write_spreads(blocks: Blocks) -> Any:
    """Writes the stage that gives a link and the joint above it their covariances."""
    stage = Stage(blocks, "spreads")
    parent = stage.of_link("parent")
    A, P, G, B = (stage.block(name) for name in ("A", "P", "G", "B"))
    Ca, Caz = stage.block("Ca"), stage.block("Caz")
    CaX, CX, BX, ACw, T, Cw = (stage.common(f"block{place}") for place in range(6))
    right, through = stage.common("block8"), stage.common("block9")
    axes = (stage.block("turn"), stage.block("offset"))
    blocks.carry_down(stage, CaX, stage.block("Ca", parent), *axes, symmetric=True)
    blocks.carry_down(stage, CX, stage.block("Caz", parent), *axes, symmetric=False)
    K, Pf = _wrench_gains(stage)
    stage.copy(Cw, CX, 36)
    blocks.product(stage, right, K, CX)
    with stage.builder.if_else(_pulled(stage)) as (pulled, free):
        with pulled:
            blocks.carry_down(stage, BX, stage.block("B", parent), *axes, symmetric=True)
            blocks.product(stage, right, Pf, BX, add=True)
            stage.fill(splat(0.0), through, 36)
            _with_joint_wrench_prior(stage, CaX, CX, BX, Cw)
        with free:
            F = stage.block("F")
            blocks.columns_down(stage, F, stage.block("F", parent), *axes)
            blocks.product(stage, through, Pf, F)
            blocks.symmetric_product(stage, B, F, F, right_turned=True, minus=True)
    blocks.product(stage, ACw, A, Cw)
    stage.copy(Caz, ACw, 36)
    blocks.product(stage, Caz, G, B, add=True)
    blocks.product(stage, T, A, CaX)
    stage.copy(Ca, P, 36)
    blocks.symmetric_product(stage, Ca, T, A, right_turned=True, add=True)
    # Only the sum of the next two is symmetric, and of each only the upper half is taken.
    blocks.symmetric_product(stage, Ca, ACw, G, right_turned=True, add=True)
    blocks.symmetric_product(stage, Ca, G, Caz, right_turned=True, add=True)
    _joint_spread(stage, CaX, Cw)
    left = T
    blocks.product(stage, left, K, CaX)
    blocks.product(stage, left, Pf, CX, right_turned=True, add=True)
    _joint_wrench_spread(stage, K, Pf, left, right, through)
    return stage.done()


def _with_joint_wrench_prior(stage: Stage, CaX: Value, CX: Value, BX: Value, Cw: Value) -> None:
    blocks, B = stage.blocks, stage.block("B")
    U, through = stage.block("U"), stage.block("through")
    first, second = stage.common("block6"), stage.common("block7")
    blocks.product(stage, Cw, CX, through, right_turned=True)
    blocks.product(stage, Cw, CaX, U, right_turned=True, add=True, minus=True)
    # B = T BX T' - U CX T' - T CX' U' + U Ca U' - Lam^-1, gathered as T (..) - U Cw.
    blocks.product(stage, first, BX, through, right_turned=True)
    blocks.product(stage, first, CX, U, left_turned=True, right_turned=True, add=True, minus=True)
    blocks.product(stage, second, through, first)
    blocks.product(stage, second, U, Cw, add=True, minus=True)
    inverse = stage.block("Lam_inv")
    for i in SIX:
        for j in range(i, 6):
            both = stage.add(stage.load(second, 6 * i + j), stage.load(second, 6 * j + i))
            mean = stage.times(splat(0.5), both)
            value = stage.subtract(mean, stage.load(inverse, 6 * i + j))
            stage.store(value, B, 6 * i + j)
            stage.store(value, B, 6 * j + i)


def _joint_spread(stage: Stage, CaX: Value, Cw: Value) -> None:
    """Variances of the joint's accelerations."""
    blocks = stage.blocks
    v, w = stage.common("vector0"), stage.common("vector1")
    variances = []
    for axis in THREE:
        r1 = stage.at(stage.block("r1"), 6 * axis)
        r2 = stage.at(stage.block("r2"), 6 * axis)
        blocks.vector_product(stage, v, CaX, r1)
        blocks.vector_product(stage, w, Cw, r2)
        for i in SIX:
            twice = stage.fused(splat(2.0), stage.load(w, i), stage.load(v, i))
            stage.store(twice, v, i)
        blocks.vector_product(stage, w, stage.block("B"), r2)
        rest = stage.load(stage.block("left"), axis)
        total = stage.dot(stage.loads(r1, 6), stage.loads(v, 6), rest)
        variances.append(stage.dot(stage.loads(r2, 6), stage.loads(w, 6), total))
    sd = stage.common("vector2")
    stage.standard_deviations(sd, variances)
    _put_dofs(stage, "joint_acceleration_sd", sd)


def _joint_wrench_spread(
    stage: Stage, K: Value, Pf: Value, left: Value, right: Value, through: Value
) -> None:
    """``Pf + left K' + right Pf - through through'``: what of it goes out."""

    def element(i: int, j: int) -> Value:
        total = stage.load(Pf, 6 * i + j)
        total = stage.dot(stage.loads(left, 6, 6 * i), stage.loads(K, 6, 6 * j), total)
        total = stage.dot(stage.loads(right, 6, 6 * i), stage.loads(Pf, 6, 6 * j), total)
        less = [stage.negative(value) for value in stage.loads(through, 6, 6 * i)]
        return stage.dot(less, stage.loads(through, 6, 6 * j), total)

    moment: list[list[Value]] = [[None] * 3 for _ in THREE]
    for i in THREE:
        for j in range(i, 3):
            moment[i][j] = moment[j][i] = element(3 + i, 3 + j)
    variances = [element(i, i) for i in THREE] + [moment[i][i] for i in THREE]
    joint = stage.builder.sub(stage.link, constant(1))
    column = stage.builder.mul(joint, constant(6))
    stage.standard_deviations(stage.output("joint_wrench_sd", column), variances)
    column = stage.builder.mul(joint, constant(9))
    out = stage.output("joint_moment_covariance", column)
    stage.stores([moment[i][j] for i in THREE for j in THREE], out)
    torques = []
    for axis in THREE:
        h = stage.loads(stage.block("h"), 3, 3 * axis)
        torques.append(stage.dot([stage.dot(moment[i], h) for i in THREE], h))
    sd = stage.common("vector2")
    stage.standard_deviations(sd, torques)
    _put_dofs(stage, "torque_sd", sd)
