"""The second pass, from the leaves to the base: each link is eliminated, then the base solved.

The recursion is that of `elimination.sweep_up`, with the same names, in the child's axes.
"""

from typing import Any

from estimation.kernel.block_products import SIX, Blocks
from estimation.kernel.layout import GLOBAL
from estimation.kernel.stage import Stage
from estimation.kernel.vector_code import Value, constant, splat

THREE = range(3)
#: A joint's acceleration is known beforehand this little beside what passes on: rounding hides it.
_HIDDEN = 1e-12


def write_eliminate(blocks: Blocks) -> Any:
    """Writes the stage that eliminates a link and adds what is left to its parent."""
    stage = Stage(blocks, "eliminate")
    J, j, M, S0, k = (stage.block(name) for name in ("J", "j", "M", "S0", "k"))
    A, P, G, MA, e, b = (stage.block(name) for name in ("A", "P", "G", "MA", "e", "b"))
    Q, JA, t, up = (stage.common(name) for name in ("block0", "block1", "vector0", "vector1"))
    # First as if the joint were stiff, then with its freedom: else what is loose drowns what is
    # sure, and their products are all rounding.
    sure = stage.common("block2")
    stage.spread_all(stage.link_constant("kinematic_inverse"), sure, 36)
    blocks.sum(stage, Q, J, sure)
    blocks.inverse(stage, P, Q, stage.common("least"))
    blocks.product(stage, A, P, sure)
    blocks.symmetric_product(stage, JA, J, A)
    _loosen(stage, P, A, JA)
    _joint_gains(stage, sure)
    blocks.vector_product(stage, e, A, b)
    blocks.vector_product(stage, e, P, j, add=True)
    blocks.vector_product(stage, t, JA, b)
    blocks.vector_product(stage, up, A, j, turned=True)
    for i in SIX:
        stage.store(stage.subtract(stage.load(up, i), stage.load(t, i)), up, i)
    blocks.product(stage, MA, M, A)
    blocks.product(stage, G, P, M, right_turned=True)
    blocks.vector_product(stage, k, M, e, add=True)
    blocks.symmetric_product(stage, S0, M, G, add=True)
    with stage.when(stage.setting("spreads")):
        _joint_spread(stage)
    with stage.builder.if_else(
        stage.builder.icmp_signed("!=", stage.setting("prior_on_joint_wrenches"), constant(0))
    ) as (pulled, free):
        with pulled:
            _joint_wrench_prior(stage, JA, up)
            _pass_up(stage, JA, up, stage.block("K"), stage.block("Pf"))
        with free:
            _pass_up(stage, JA, up, MA, S0)
    return stage.done()


def _pass_up(stage: Stage, J: Value, j: Value, K: Value, Pf: Value) -> None:
    blocks, parent = stage.blocks, stage.of_link("parent")
    axes = (stage.block("turn"), stage.block("offset"))
    blocks.carry_up(stage, stage.block("J", parent), J, *axes, symmetric=True)
    blocks.carry_up(stage, stage.block("M", parent), K, *axes, symmetric=False)
    blocks.carry_up(stage, stage.block("S0", parent), Pf, *axes, symmetric=True)
    blocks.wrench_up(stage, stage.block("j", parent), j, *axes)
    blocks.wrench_up(stage, stage.block("k", parent), stage.block("k"), *axes)


def _loosen(stage: Stage, P: Value, A: Value, JA: Value) -> None:
    """Lets the joint move as much as its accelerations vary.

    With ``D = (Gs^-1 + H' JA H)^-1``: ``P += A H D H' A'``, ``A -= A H D H' JA``,
    ``JA -= JA H D H' JA``. Derived here.
    """
    h = _axes(stage)
    JH = [[stage.dot(stage.loads(JA, 3, 6 * i + 3), h[axis]) for i in SIX] for axis in THREE]
    AH = [[stage.dot(stage.loads(A, 3, 6 * i + 3), h[axis]) for i in SIX] for axis in THREE]
    D = _free_inverse(stage, h, JH)
    least = stage.load(stage.common("least"))
    for axis in THREE:
        own = stage.over(splat(1.0), stage.load(stage.block("variance"), axis))
        past = stage.dot(h[axis], JH[axis][3:])
        least = stage.smaller(stage.fused(splat(-_HIDDEN), past, own), least)
    stage.store(least, stage.common("least"))
    for i in SIX:
        a = [stage.dot([AH[m][i] for m in THREE], D[axis]) for axis in THREE]
        less = [stage.negative(value) for value in a]
        j = [stage.negative(stage.dot([JH[m][i] for m in THREE], D[axis])) for axis in THREE]
        for k in SIX:
            along = [JH[axis][k] for axis in THREE]
            stage.store(stage.dot(less, along, stage.load(A, 6 * i + k)), A, 6 * i + k)
            if k < i:
                continue
            more = stage.dot(a, [AH[axis][k] for axis in THREE], stage.load(P, 6 * i + k))
            rest = stage.dot(j, along, stage.load(JA, 6 * i + k))
            for block, value in ((P, more), (JA, rest)):
                stage.store(value, block, 6 * i + k)
                stage.store(value, block, 6 * k + i)


def _axes(stage: Stage) -> list[list[Value]]:
    return [stage.loads(stage.block("h"), 3, 3 * axis) for axis in THREE]


def _free_inverse(
    stage: Stage, h: list[list[Value]], columns: list[list[Value]]
) -> list[list[Value]]:
    """``(Gs^-1 + H' columns)^-1``; one for axes that are absent."""
    inner = [[stage.dot(h[m], columns[n][3:]) for n in THREE] for m in THREE]
    for axis in THREE:
        own = stage.over(splat(1.0), stage.load(stage.block("variance"), axis))
        inner[axis][axis] = stage.add(inner[axis][axis], own)
    return _inverse_of_three(stage, inner)


def _joint_gains(stage: Stage, sure: Value) -> None:
    """``W = (Gs^-1 + H' SACC^-1 H)^-1``, ``r = SACC^-1 H W``; columns of absent axes are zero."""
    h = _axes(stage)
    weighted = [
        [stage.dot(stage.loads(sure, 3, 6 * i + 3), h[axis]) for i in SIX] for axis in THREE
    ]
    W = _free_inverse(stage, h, weighted)
    for axis in THREE:
        for i in SIX:
            value = stage.dot([weighted[m][i] for m in THREE], [W[m][axis] for m in THREE])
            stage.store(value, stage.block("r"), 6 * axis + i)
        stage.store(W[axis][axis], stage.block("left"), axis)


def _joint_spread(stage: Stage) -> None:
    """``r1 = -J P r``, ``r2 = G' r`` and the part of the variance that no other link changes."""
    blocks, v = stage.blocks, stage.common("vector2")
    for axis in THREE:
        column = stage.at(stage.block("r"), 6 * axis)
        blocks.vector_product(stage, v, stage.block("P"), column)
        rest = stage.load(stage.block("left"), axis)
        both = stage.dot(stage.loads(column, 6), stage.loads(v, 6), rest)
        stage.store(both, stage.block("left"), axis)
        r1 = stage.at(stage.block("r1"), 6 * axis)
        blocks.vector_product(stage, r1, stage.block("J"), v)
        for i in SIX:
            stage.store(stage.negative(stage.load(r1, i)), r1, i)
        r2 = stage.at(stage.block("r2"), 6 * axis)
        blocks.vector_product(stage, r2, stage.block("G"), column, turned=True)


def _inverse_of_three(stage: Stage, m: list[list[Value]]) -> list[list[Value]]:
    """The inverse of a symmetric positive 3x3 block, by elimination."""
    one = splat(1.0)
    d0 = stage.over(one, m[0][0])
    l1, l2 = stage.times(m[0][1], d0), stage.times(m[0][2], d0)
    d1 = stage.over(one, stage.subtract(m[1][1], stage.times(l1, m[0][1])))
    rest = stage.subtract(m[1][2], stage.times(l1, m[0][2]))
    l3 = stage.times(rest, d1)
    last = stage.subtract(m[2][2], stage.times(l2, m[0][2]))
    d2 = stage.over(one, stage.subtract(last, stage.times(l3, rest)))
    # The inverse of L is [1; -l1, 1; l1 l3 - l2, -l3, 1].
    n = stage.subtract(stage.times(l1, l3), l2)
    c22, c12, c02 = d2, stage.negative(stage.times(l3, d2)), stage.times(n, d2)
    c11 = stage.subtract(d1, stage.times(l3, c12))
    c01 = stage.subtract(stage.negative(stage.times(l1, d1)), stage.times(l3, c02))
    c00 = stage.add(stage.add(d0, stage.times(stage.times(l1, l1), d1)), stage.times(n, c02))
    return [[c00, c01, c02], [c01, c11, c12], [c02, c12, c22]]


def _joint_wrench_prior(stage: Stage, JA: Value, up: Value) -> None:
    """Adds what the prior tells about the joint's wrench; for comparison with the papers."""
    blocks = stage.blocks
    Sf, Lam = stage.common("block3"), stage.common("block4")
    constants = stage.table("constants")
    MA, S0, k, u0 = (stage.block(name) for name in ("MA", "S0", "k", "u0"))
    U, through, inverse = (stage.block(name) for name in ("U", "through", "Lam_inv"))
    stage.spread_all(stage.number(constants, GLOBAL["joint_wrench_prior"]), Sf, 36)
    blocks.sum(stage, Lam, S0, Sf)
    blocks.inverse(stage, inverse, Lam, stage.common("least"))
    blocks.product(stage, U, inverse, MA)
    blocks.product(stage, through, inverse, Sf)
    mu = stage.spread(stage.real(constants, GLOBAL["prior_mean"]))
    off = stage.common("vector2")
    for i in SIX:
        stage.store(stage.subtract(mu, stage.load(k, i)), off, i)
    blocks.vector_product(stage, u0, inverse, off)
    blocks.symmetric_product(stage, JA, MA, U, left_turned=True, add=True)
    blocks.vector_product(stage, up, MA, u0, turned=True, add=True)
    blocks.vector_product(stage, k, S0, u0, add=True)
    blocks.product(stage, stage.block("K"), Sf, U)
    blocks.symmetric_product(stage, stage.block("Pf"), through, S0, left_turned=True)


def write_root(blocks: Blocks) -> Any:
    """Writes the stage that solves for the base."""
    stage = Stage(blocks, "root")
    J, j, M, R, b0 = (stage.block(name) for name in ("J", "j", "M", "S0", "k"))
    a, z, B = (stage.block(name) for name in ("a", "z", "B"))
    R_inv, N, C, J_inv, T = (stage.common(f"block{place}") for place in range(5))
    v, w = stage.common("vector0"), stage.common("vector1")
    trace = stage.dot([splat(1.0)] * 6, [stage.load(J, 7 * i) for i in SIX])
    stage.store(trace, stage.output("status"), 1)
    blocks.inverse(stage, R_inv, R, stage.common("least"))
    blocks.product(stage, N, R_inv, M)
    stage.store(blocks.inverse(stage, J_inv, J, stage.common("least")), stage.output("status"))
    # What motion and measured wrenches leave over before the equations are imposed.
    residual = stage.output("residual")
    blocks.vector_product(stage, v, J_inv, j)
    stage.copy(residual, b0, 6)
    blocks.vector_product(stage, residual, M, v, add=True)
    blocks.product(stage, T, M, J_inv)
    blocks.symmetric_product(stage, R, T, M, right_turned=True, add=True)
    F = stage.block("F")
    blocks.inverse_factor(stage, F, R, stage.common("least"))
    blocks.symmetric_product(stage, B, F, F, right_turned=True, minus=True)
    blocks.vector_product(stage, w, B, residual)
    chi2 = stage.negative(stage.dot(stage.loads(residual, 6), stage.loads(w, 6)))
    stage.store(chi2, stage.output("residual_chi2"))
    blocks.symmetric_product(stage, J, M, N, left_turned=True, add=True)
    blocks.inverse(stage, C, J, stage.common("least"))
    stage.copy(v, j, 6)
    blocks.vector_product(stage, w, N, b0, turned=True)
    for i in SIX:
        stage.store(stage.subtract(stage.load(v, i), stage.load(w, i)), v, i)
    blocks.vector_product(stage, a, C, v)
    blocks.vector_product(stage, b0, M, a, add=True)
    blocks.vector_product(stage, z, R_inv, b0)
    for i in SIX:
        stage.store(stage.negative(stage.load(z, i)), z, i)
    stage.copy(stage.block("Ca"), C, 36)
    blocks.product(stage, stage.block("Caz"), C, N, right_turned=True, minus=True)
    return stage.done()
