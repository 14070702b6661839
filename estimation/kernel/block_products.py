"""Products, inverses and changes of axes of 6x6 blocks, each a small function of the kernel.

``X = [T', -T' S(p); 0, T']`` carries accelerations into axes turned by ``T`` about a point ``p``
further on; it is never formed, since six products of 3x3 blocks do.
"""

from typing import Any

from estimation.kernel.vector_code import POINTER, VECTOR, Code, Value, constant, splat

#: A pivot this small beside what it was taken from has lost nearly all its digits.
_LOST = 1e-12
SIX = range(6)
THREE = range(3)


class Blocks:
    """The kernel's small functions, each written when it is first asked for."""

    def __init__(self, module: Any, rows_at_once: int) -> None:
        """Takes the module, and how many rows of a product the processor's registers hold."""
        self.module = module
        self.rows_at_once = rows_at_once
        self._known: dict[str, Any] = {}

    def start(self, name: str, pointers: int, result: Any = None) -> Code:
        """Starts a function of that many blocks that is not called from outside."""
        code = Code(self.module, name, [POINTER] * pointers, result)
        code.function.linkage = "internal"
        code.function.attributes.add("noinline")
        return code

    def _call(self, into: Code, name: str, write: Any, *blocks: Value) -> Value:
        if name not in self._known:
            self._known[name] = write(name)
        return into.builder.call(self._known[name], blocks)

    def product(
        self,
        into: Code,
        out: Value,
        left: Value,
        right: Value,
        *,
        left_turned: bool = False,
        right_turned: bool = False,
        add: bool = False,
        minus: bool = False,
    ) -> None:
        """Writes ``out (+)= (-) left right``, either transposed if ``turned``."""

        def write(name: str) -> Any:
            code = self.start(name, 3)
            C, A, B = code.arguments
            many = self.rows_at_once
            with code.loop(0, 6 // many) as group:
                first = code.builder.mul(group, constant(many))
                lines = []
                for place in range(many):
                    row = code.builder.add(first, constant(place))
                    along = code.builder.mul(row, constant(6))
                    c = code.at(C, along)
                    rest: list[Value] = code.loads(c, 6) if add else [None] * 6
                    lines.append((code.at(A, row if left_turned else along), c, rest))
                # One factor at a time for all columns: sums that do not wait for one another.
                for k in SIX:
                    factors = [code.load(a, 6 * k if left_turned else k) for a, _, _ in lines]
                    for j in SIX:
                        other = code.load(B, 6 * j + k if right_turned else 6 * k + j)
                        for factor, (_, _, rest) in zip(factors, lines, strict=True):
                            signed = code.negative(factor) if minus else factor
                            rest[j] = code.dot([signed], [other], rest[j])
                for _, c, rest in lines:
                    code.stores(rest, c)
            return code.done()

        name = f"product{'_lt' * left_turned}{'_rt' * right_turned}{'_add' * add}{'_m' * minus}"
        self._call(into, name, write, out, left, right)

    def symmetric_product(
        self,
        into: Code,
        out: Value,
        left: Value,
        right: Value,
        *,
        left_turned: bool = False,
        right_turned: bool = False,
        add: bool = False,
        minus: bool = False,
    ) -> None:
        """The same where the result is known to be symmetric: half the work, and exactly so."""

        def write(name: str) -> Any:
            code = self.start(name, 3)
            C, A, B = code.arguments
            for i in SIX:
                row = [code.load(C, 6 * i + j) if add else None for j in range(i, 6)]
                for k in SIX:
                    factor = code.load(A, 6 * k + i if left_turned else 6 * i + k)
                    factor = code.negative(factor) if minus else factor
                    for place, j in enumerate(range(i, 6)):
                        other = code.load(B, 6 * j + k if right_turned else 6 * k + j)
                        row[place] = code.dot([factor], [other], row[place])
                for place, j in enumerate(range(i, 6)):
                    code.store(row[place], C, 6 * i + j)
                    if j > i:
                        code.store(row[place], C, 6 * j + i)
            return code.done()

        name = f"symmetric{'_lt' * left_turned}{'_rt' * right_turned}{'_add' * add}{'_m' * minus}"
        self._call(into, name, write, out, left, right)

    def vector_product(
        self,
        into: Code,
        out: Value,
        matrix: Value,
        vector: Value,
        *,
        turned: bool = False,
        add: bool = False,
    ) -> None:
        """Writes ``out (+)= matrix vector``."""

        def write(name: str) -> Any:
            code = self.start(name, 3)
            y, A, x = code.arguments
            total: list[Value] = code.loads(y, 6) if add else [None] * 6
            for k in SIX:
                factor = code.load(x, k)
                for i in SIX:
                    element = code.load(A, 6 * k + i if turned else 6 * i + k)
                    total[i] = code.dot([element], [factor], total[i])
            code.stores(total, y)
            return code.done()

        self._call(into, f"vector{'_t' * turned}{'_add' * add}", write, out, matrix, vector)

    def sum(self, into: Code, out: Value, left: Value, right: Value) -> None:
        """Writes ``out = left + right`` of 6x6 blocks."""

        def write(name: str) -> Any:
            code = self.start(name, 3)
            C, A, B = code.arguments
            with code.loop(0, 36) as slot:
                code.store(code.add(code.load(A, slot), code.load(B, slot)), C, slot)
            return code.done()

        self._call(into, "sum", write, out, left, right)

    def inverse(self, into: Code, out: Value, matrix: Value, least: Value) -> Value:
        """Writes the inverse of a symmetric positive block; returns its least pivot.

        ``A = L D L'`` without square roots; only the lower triangle is read. The slot ``least``
        falls below zero where hardly a digit of the inverse is left.
        """

        def write(name: str) -> Any:
            code = self.start(name, 3, VECTOR)
            C, A, digits = code.arguments
            pivot, inverted, N = _eliminated(code, A, digits)
            scaled = {key: code.times(value, inverted[key[0]]) for key, value in N.items()}
            for i in SIX:
                for j in range(i + 1):
                    value = inverted[i] if i == j else scaled[i, j]
                    for k in range(i + 1, 6):
                        value = code.fused(N[k, i], scaled[k, j], value)
                    code.store(value, C, 6 * i + j)
                    if i != j:
                        code.store(value, C, 6 * j + i)
            return code.done(pivot)

        return self._call(into, "inverse", write, out, matrix, least)

    def inverse_factor(self, into: Code, out: Value, matrix: Value, least: Value) -> None:
        """Writes ``F`` with ``F F'`` the inverse of a symmetric positive block."""

        def write(name: str) -> Any:
            code = self.start(name, 3)
            C, A, digits = code.arguments
            _, inverted, N = _eliminated(code, A, digits)
            for k in SIX:
                size = code.root(inverted[k])
                for i in SIX:
                    value = splat(0.0) if i > k else size
                    if i < k:
                        value = code.times(N[k, i], size)
                    code.store(value, C, 6 * i + k)
            return code.done()

        self._call(into, "inverse_factor", write, out, matrix, least)

    def carry_up(
        self, into: Code, out: Value, matrix: Value, T: Value, p: Value, *, symmetric: bool
    ) -> None:
        """Writes ``out += X' matrix X``: from a child's axes and point to its parent's."""

        def write(name: str) -> Any:
            code = self.start(name, 4)
            C, A, turn, place = code.arguments
            E = _Turn(code, turn, back=False)
            r = code.loads(place, 3)
            a = E.about(A, 0, 0, symmetric)
            b = E.about(A, 0, 3, False)
            d = E.about(A, 3, 3, symmetric)
            c = _flip(b) if symmetric else E.about(A, 3, 0, False)
            # T'M T with T = [1, -S; 0, 1]: rows below gain S times those above, columns likewise.
            Sa, Sb = _lever_left(code, r, a), _lever_left(code, r, b)
            c = _plus(code, c, Sa)
            d = _plus(code, d, Sb)
            b = _minus(code, b, _lever_right(code, a, r))
            d = _minus(code, d, _lever_right(code, c, r))
            _add_blocks(code, C, a, b, c, d, symmetric)
            return code.done()

        self._call(into, f"carry_up{'_s' * symmetric}", write, out, matrix, T, p)

    def carry_down(
        self, into: Code, out: Value, matrix: Value, T: Value, p: Value, *, symmetric: bool
    ) -> None:
        """Writes ``out = X matrix X'``: from a parent's axes and point to its child's."""

        def write(name: str) -> Any:
            code = self.start(name, 4)
            C, A, turn, place = code.arguments
            r = code.loads(place, 3)
            a, b, c, d = (_read(code, A, i, j) for i, j in ((0, 0), (0, 3), (3, 0), (3, 3)))
            # T M T' with T = [1, -S; 0, 1].
            a = _minus(code, a, _lever_left(code, r, c))
            b = _minus(code, b, _lever_left(code, r, d))
            a = _plus(code, a, _lever_right(code, b, r))
            if not symmetric:
                c = _plus(code, c, _lever_right(code, d, r))
            E = _Turn(code, turn, back=True)
            blocks = [((0, 0), a, symmetric), ((0, 3), b, False), ((3, 3), d, symmetric)]
            if not symmetric:
                blocks.append(((3, 0), c, False))
            for (i, j), block, half in blocks:
                turned = E.of(block, half)
                for m in THREE:
                    for n in THREE:
                        code.store(turned[m][n], C, 6 * (i + m) + j + n)
                        if symmetric and i != j:
                            code.store(turned[m][n], C, 6 * (j + n) + i + m)
            return code.done()

        self._call(into, f"carry_down{'_s' * symmetric}", write, out, matrix, T, p)

    def wrench_up(self, into: Code, out: Value, vector: Value, T: Value, p: Value) -> None:
        """Writes ``out += X' vector``."""

        def write(name: str) -> Any:
            code = self.start(name, 4)
            y, x, turn, place = code.arguments
            f = [
                [code.dot(code.loads(turn, 3, 3 * i), code.loads(x, 3, first)) for i in THREE]
                for first in (0, 3)
            ]
            lever = code.cross(code.loads(place, 3), f[0])
            for i in THREE:
                code.store(code.add(code.load(y, i), f[0][i]), y, i)
                moment = code.add(f[1][i], lever[i])
                code.store(code.add(code.load(y, 3 + i), moment), y, 3 + i)
            return code.done()

        self._call(into, "wrench_up", write, out, vector, T, p)

    def motion_down(self, into: Code, out: Value, vector: Value, T: Value, p: Value) -> None:
        """Writes ``out = X vector``."""

        def write(name: str) -> Any:
            code = self.start(name, 4)
            y, x, turn, place = code.arguments
            angular = code.loads(x, 3, 3)
            lever = code.cross(angular, code.loads(place, 3))
            linear = [code.add(code.load(x, i), lever[i]) for i in THREE]
            for first, part in ((0, linear), (3, angular)):
                for i in THREE:
                    column = [code.load(turn, 3 * k + i) for k in THREE]
                    code.store(code.dot(column, part), y, first + i)
            return code.done()

        self._call(into, "motion_down", write, out, vector, T, p)

    def columns_down(self, into: Code, out: Value, matrix: Value, T: Value, p: Value) -> None:
        """Writes ``out = X matrix``."""

        def write(name: str) -> Any:
            code = self.start(name, 4)
            C, A, turn, place = code.arguments
            with code.loop(0, 6) as column:
                y, x = code.at(C, column), code.at(A, column)
                angular = [code.load(x, 6 * i) for i in range(3, 6)]
                lever = code.cross(angular, code.loads(place, 3))
                linear = [code.add(code.load(x, 6 * i), lever[i]) for i in THREE]
                for first, part in ((0, linear), (3, angular)):
                    for i in THREE:
                        axis = [code.load(turn, 3 * k + i) for k in THREE]
                        code.store(code.dot(axis, part), y, 6 * (first + i))
            return code.done()

        self._call(into, "columns_down", write, out, matrix, T, p)

    def transform(self, into: Code, out: Value, T: Value, p: Value) -> None:
        """Writes ``X`` itself, 36 slots."""

        def write(name: str) -> Any:
            code = self.start(name, 3)
            C, turn, place = code.arguments
            r = code.loads(place, 3)
            for i in THREE:
                row = [code.load(turn, 3 * k + i) for k in THREE]
                # A row of -T' S(p) is the cross product of p and that row of T'.
                lever = code.cross(r, row)
                for j in THREE:
                    code.store(row[j], C, 6 * i + j)
                    code.store(row[j], C, 6 * (3 + i) + 3 + j)
                    code.store(lever[j], C, 6 * i + 3 + j)
                    code.store(splat(0.0), C, 6 * (3 + i) + j)
            return code.done()

        self._call(into, "transform", write, out, T, p)


Rows = list[list[Value]]
Corner = dict[tuple[int, int], Value]


def _eliminated(code: Code, A: Value, digits: Value) -> tuple[Value, list[Value], Corner]:
    """The least pivot of ``A = L D L'``, the inverse of ``D``, and that of ``L`` below its ones."""
    most_lost = code.load(digits)
    L: Corner = {}
    weighted: Corner = {}
    N: Corner = {}
    least, inverted = None, []
    for j in SIX:
        whole = pivot = code.load(A, 6 * j + j)
        for k in range(j):
            pivot = code.subtract(pivot, code.times(L[j, k], weighted[j, k]))
        margin = code.fused(splat(-_LOST), whole, pivot)
        most_lost = code.smaller(margin, most_lost)
        least = pivot if least is None else code.smaller(pivot, least)
        inverted.append(code.over(splat(1.0), pivot))
        for i in range(j + 1, 6):
            value = code.load(A, 6 * i + j)
            for k in range(j):
                value = code.subtract(value, code.times(L[i, k], weighted[j, k]))
            weighted[i, j] = value
            L[i, j] = code.times(value, inverted[j])
    for j in SIX:
        for i in range(j + 1, 6):
            value = L[i, j]
            for k in range(j + 1, i):
                value = code.fused(L[i, k], N[k, j], value)
            N[i, j] = code.negative(value)
    code.store(most_lost, digits)
    return least, inverted, N


def _read(code: Code, block: Value, first_row: int, first_column: int) -> Rows:
    return [
        [code.load(block, 6 * (first_row + i) + first_column + j) for j in THREE] for i in THREE
    ]


def _flip(rows: Rows) -> Rows:
    return [[rows[j][i] for j in THREE] for i in THREE]


def _plus(code: Code, left: Rows, right: Rows) -> Rows:
    return [[code.add(left[i][j], right[i][j]) for j in THREE] for i in THREE]


def _minus(code: Code, left: Rows, right: Rows) -> Rows:
    return [[code.subtract(left[i][j], right[i][j]) for j in THREE] for i in THREE]


def _lever_left(code: Code, r: list[Value], rows: Rows) -> Rows:
    """``S(r) rows``: every column crossed by ``r`` from the left."""
    columns = [code.cross(r, [rows[i][j] for i in THREE]) for j in THREE]
    return _flip(columns)


def _lever_right(code: Code, rows: Rows, r: list[Value]) -> Rows:
    """``rows S(r)``: every row crossed by ``r`` from the right."""
    return [code.cross(row, r) for row in rows]


def _add_blocks(
    code: Code, out: Value, a: Rows, b: Rows, c: Rows, d: Rows, symmetric: bool
) -> None:
    whole = [[*a[i], *b[i]] for i in THREE] + [[*c[i], *d[i]] for i in THREE]
    for i in SIX:
        for j in SIX:
            value = whole[min(i, j)][max(i, j)] if symmetric else whole[i][j]
            code.store(code.add(code.load(out, 6 * i + j), value), out, 6 * i + j)


class _Turn:
    """``E M E'`` with ``E = T``, or ``T'`` if ``back``."""

    def __init__(self, code: Code, turn: Value, *, back: bool) -> None:
        self.code = code
        rows = [[code.load(turn, 3 * i + j) for j in THREE] for i in THREE]
        self.E = _flip(rows) if back else rows

    def about(self, block: Value, row: int, column: int, half: bool) -> Rows:
        return self.of(_read(self.code, block, row, column), half)

    def of(self, rows: Rows, half: bool) -> Rows:
        code, E = self.code, self.E
        columns = _flip(rows)
        left = [[code.dot(E[i], columns[j]) for j in THREE] for i in THREE]
        out: Rows = [[None] * 3 for _ in THREE]
        for i in THREE:
            for j in range(i if half else 0, 3):
                out[i][j] = code.dot(left[i], E[j])
                if half:
                    out[j][i] = out[i][j]
        return out
