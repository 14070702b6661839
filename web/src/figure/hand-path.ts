import {
  CatmullRomCurve3,
  Color,
  Group,
  Mesh,
  MeshBasicMaterial,
  SphereGeometry,
  TubeGeometry,
  Vector3,
} from "three";

const SIDES = 8;
const MAX_PIECES = 400;

/** The path the robot asks of the hand: what is done drawn full, what is to come drawn faint. */
export class HandPath {
  readonly group = new Group();
  readonly #done: Mesh<TubeGeometry, MeshBasicMaterial> | null = null;
  readonly #rest: Mesh<TubeGeometry, MeshBasicMaterial> | null = null;
  readonly #goal: Mesh<SphereGeometry, MeshBasicMaterial>;
  readonly #pieces: number = 0;

  /** @param points Positions in the world, metres, evenly spread over the samples in time. */
  constructor(private readonly points: readonly (readonly number[])[]) {
    const vectors = points.map(([x, y, z]) => new Vector3(x, y, z));
    this.#goal = new Mesh(
      new SphereGeometry(0.018, 20, 14),
      new MeshBasicMaterial({ toneMapped: false }),
    );
    const length = vectors.reduce(
      (sum, point, i) => (i === 0 ? 0 : sum + point.distanceTo(vectors[i - 1]!)),
      0,
    );
    if (vectors.length > 1 && length > 1e-6) {
      const curve = new CatmullRomCurve3(vectors);
      this.#pieces = Math.min(MAX_PIECES, 4 * (vectors.length - 1));
      const tube = (opacity: number) =>
        new Mesh(
          // By parameter, not by length: the share drawn must match the share of the time.
          new ParameterTube(curve, this.#pieces),
          new MeshBasicMaterial({ transparent: opacity < 1, opacity, toneMapped: false }),
        );
      this.#done = tube(1);
      this.#rest = tube(0.35);
      this.group.add(this.#done, this.#rest);
    }
    this.group.add(this.#goal);
  }

  setColour(colour: Color): void {
    for (const mesh of [this.#done, this.#rest, this.#goal]) mesh?.material.color.copy(colour);
  }

  /** @param share Place along the samples, 0 to 1. */
  setProgress(share: number): void {
    const last = this.points.length - 1;
    const place = Math.min(1, Math.max(0, share)) * last;
    const index = Math.min(Math.floor(place), Math.max(0, last - 1));
    const from = new Vector3(...(this.points[index] as [number, number, number]));
    const to = new Vector3(...(this.points[Math.min(index + 1, last)] as [number, number, number]));
    this.#goal.position.copy(from.lerp(to, place - index));
    const ring = SIDES * 6;
    const cut = Math.round(Math.min(1, Math.max(0, share)) * this.#pieces) * ring;
    this.#done?.geometry.setDrawRange(0, cut);
    this.#rest?.geometry.setDrawRange(cut, Infinity);
  }

  dispose(): void {
    this.group.removeFromParent();
    for (const mesh of [this.#done, this.#rest, this.#goal]) {
      mesh?.geometry.dispose();
      mesh?.material.dispose();
    }
  }
}

/** A tube whose rings stand at equal steps of the curve's parameter. */
class ParameterTube extends TubeGeometry {
  constructor(curve: CatmullRomCurve3, pieces: number) {
    const byParameter = new CatmullRomCurve3(curve.points);
    byParameter.getPointAt = (t, target) => curve.getPoint(t, target);
    byParameter.getTangentAt = (t, target) => curve.getTangent(t, target);
    super(byParameter, pieces, 0.0055, SIDES, false);
  }
}
