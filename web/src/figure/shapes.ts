import { BufferGeometry, LatheGeometry, Matrix4, Quaternion, Vector2, Vector3 } from "three";

/**
 * Half-widths of the body's parts as fractions of stature: `[near, far]` radius of a limb.
 *
 * For the eye only: masses and moments come from the service's own model.
 */
export const LIMBS: Readonly<Record<string, readonly [number, number]>> = {
  UpperArm: [0.0275, 0.0215],
  ForeArm: [0.0225, 0.0155],
  Hand: [0.0165, 0.0125],
  Shoulder: [0.021, 0.0285],
  UpperLeg: [0.049, 0.0315],
  LowerLeg: [0.031, 0.0205],
  Foot: [0.0225, 0.0185],
  Toe: [0.0185, 0.0135],
  Neck: [0.031, 0.027],
};

/** Trunk sections: half-depth (forward) and half-width (sideways), fractions of stature. */
export const TRUNK: Readonly<Record<string, readonly [number, number]>> = {
  Pelvis: [0.062, 0.089],
  L5: [0.059, 0.08],
  L3: [0.058, 0.077],
  T12: [0.062, 0.083],
  T8: [0.066, 0.095],
};

const RINGS = 10;
const SIDES = 28;

/** A solid of revolution about +y from a ball of radius `r0` at 0 to one of radius `r1` at `length`. */
export function roundCone(r0: number, r1: number, length: number): BufferGeometry {
  const points: Vector2[] = [];
  // The balls meet the cone where it touches them, which leans with the taper.
  const lean = Math.asin(Math.min(1, Math.max(-1, (r0 - r1) / Math.max(length, 1e-6))));
  for (let i = 0; i <= RINGS; i++) {
    const angle = -Math.PI / 2 + (i / RINGS) * (Math.PI / 2 + lean);
    points.push(new Vector2(Math.max(0, r0 * Math.cos(angle)), r0 * Math.sin(angle)));
  }
  for (let i = 0; i <= RINGS; i++) {
    const angle = lean + (i / RINGS) * (Math.PI / 2 - lean);
    points.push(new Vector2(Math.max(0, r1 * Math.cos(angle)), length + r1 * Math.sin(angle)));
  }
  return new LatheGeometry(points, SIDES);
}

/** Turns a shape that runs along +y so that it runs from `from` to `to`. */
export function between(geometry: BufferGeometry, from: Vector3, to: Vector3): BufferGeometry {
  const direction = to.clone().sub(from);
  const turn = new Quaternion().setFromUnitVectors(new Vector3(0, 1, 0), direction.normalize());
  return geometry.applyMatrix4(new Matrix4().compose(from, turn, new Vector3(1, 1, 1)));
}

/**
 * A trunk section: an elliptic barrel along +z, rounded at both ends, between two sections.
 *
 * @param low Half-depth and half-width at its lower end, metres.
 * @param high The same at its upper end.
 */
export function barrel(
  low: readonly [number, number],
  high: readonly [number, number],
  length: number,
): BufferGeometry {
  const round = 0.42 * Math.min(low[0], high[0]);
  const points: Vector2[] = [];
  for (let i = 0; i <= RINGS; i++) {
    const angle = -Math.PI / 2 + (i / RINGS) * (Math.PI / 2);
    points.push(new Vector2(Math.cos(angle), round * Math.sin(angle)));
  }
  for (let i = 0; i <= RINGS; i++) {
    const angle = (i / RINGS) * (Math.PI / 2);
    points.push(new Vector2(Math.cos(angle), length + round * Math.sin(angle)));
  }
  const geometry = new LatheGeometry(points, SIDES * 2);
  geometry.applyMatrix4(new Matrix4().makeRotationX(Math.PI / 2));
  const positions = geometry.getAttribute("position");
  for (let i = 0; i < positions.count; i++) {
    const along = Math.min(1, Math.max(0, positions.getZ(i) / Math.max(length, 1e-6)));
    const depth = low[0] + along * (high[0] - low[0]);
    const width = low[1] + along * (high[1] - low[1]);
    positions.setX(i, positions.getX(i) * depth);
    positions.setY(i, positions.getY(i) * width);
  }
  geometry.computeVertexNormals();
  return geometry;
}
