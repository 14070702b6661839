import numpy as np
import pytest

from human.shapes import Box, Cylinder, Sphere

ORIGIN = (0.0, 0.0, 0.0)


def cloud(inside, half, rng, count=400_000):
    """Points spread evenly over a solid, by rejection from its bounding box."""
    points = rng.uniform(-1.0, 1.0, (count, 3)) * half
    return points[inside(points)]


@pytest.mark.parametrize(
    ("shape", "half", "inside"),
    [
        (Box((0.3, 0.2, 0.1), ORIGIN), (0.15, 0.1, 0.05), lambda p: np.full(len(p), True)),
        (
            Cylinder(0.1, 0.4, 1, ORIGIN),
            (0.1, 0.2, 0.1),
            lambda p: np.hypot(p[:, 0], p[:, 2]) <= 0.1,
        ),
        (Sphere(0.1, ORIGIN), (0.1, 0.1, 0.1), lambda p: np.linalg.norm(p, axis=1) <= 0.1),
    ],
    ids=["box", "cylinder", "sphere"],
)
def test_inertia_and_volume_by_monte_carlo(shape, half, inside, rng):
    points = cloud(inside, half, rng)
    share = len(points) / 400_000
    assert shape.volume() == pytest.approx(share * 8.0 * np.prod(half), rel=5e-3)
    mass = 2.5
    square = np.einsum("ni,nj->ij", points, points) / len(points) * mass
    expected = np.trace(square) * np.eye(3) - square
    np.testing.assert_allclose(shape.inertia(mass), expected, atol=8e-3 * np.max(expected))
