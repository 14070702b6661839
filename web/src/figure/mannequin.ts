import {
  type BufferGeometry,
  Color,
  type Material,
  Mesh,
  MeshBasicMaterial,
  MeshStandardMaterial,
  SphereGeometry,
  Vector3,
} from "three";

import { LIMBS, TRUNK, barrel, between, roundCone } from "./shapes";
import type { SegmentSpan, Skeleton } from "./skeleton";

const side = (segment: string) => segment.replace(/^(Right|Left)/, "");

/** The outline of a person hung on a skeleton, with a marker at every spherical joint. */
export class Mannequin {
  readonly joints = new Map<string, Mesh<BufferGeometry, MeshBasicMaterial>>();
  /** Height from sole to crown, metres; for the eye, within a few per cent. */
  readonly stature: number;
  readonly #owned: (BufferGeometry | Material)[] = [];
  readonly skin: MeshStandardMaterial;

  /**
   * @param ghost Draws a faint outline without joint markers, to show a sample among several.
   */
  constructor(
    readonly skeleton: Skeleton,
    readonly ghost = false,
  ) {
    // From joint to joint the body is a little shorter than from sole to crown.
    this.stature = skeleton.span * 1.17;
    this.skin = new MeshStandardMaterial({
      roughness: 0.78,
      metalness: 0,
      transparent: ghost,
      opacity: ghost ? 0.16 : 1,
      depthWrite: !ghost,
      // Where a sample agrees with the body it must not tint it.
      polygonOffset: ghost,
      polygonOffsetFactor: 6,
      polygonOffsetUnits: 12,
    });
    this.#owned.push(this.skin);
    for (const [name, span] of skeleton.spans) {
      for (const geometry of this.#shapesOf(name, span)) this.#hang(geometry, this.skin, span);
    }
    if (!ghost) this.#addJoints();
  }

  setSkin(colour: Color): void {
    this.skin.color.copy(colour);
  }

  /** Colours one joint's marker; null puts it back to the body's own colour. */
  setJointColour(joint: string, colour: Color | null): void {
    const marker = this.joints.get(joint);
    if (!marker) return;
    marker.visible = colour !== null;
    if (colour) marker.material.color.copy(colour);
  }

  dispose(): void {
    this.skeleton.robot.removeFromParent();
    for (const item of this.#owned) item.dispose();
  }

  #hang(geometry: BufferGeometry, material: Material, span: SegmentSpan): Mesh {
    const mesh = new Mesh(geometry, material);
    mesh.castShadow = !this.ghost;
    mesh.receiveShadow = !this.ghost;
    span.link.add(mesh);
    this.#owned.push(geometry);
    return mesh;
  }

  #shapesOf(name: string, span: SegmentSpan): BufferGeometry[] {
    const h = this.stature;
    const part = side(name);
    if (part === "Head") return [this.#head(), this.#nose()];
    if (part === "Pelvis") {
      const section = this.#section("Pelvis");
      const top = [...span.ends].find(([child]) => child === "L5")?.[1] ?? new Vector3();
      const low = Math.min(0, ...[...span.ends.values()].map((end) => end.z)) - 0.012 * h;
      const shape = barrel([section[0] * 0.92, section[1]], this.#section("L5"), top.z - low);
      return [shape.translate(top.x / 2, 0, low)];
    }
    const trunk = TRUNK[part];
    if (trunk) {
      const above = { L5: "L3", L3: "T12", T12: "T8" }[part];
      const end = [...span.ends].find(([child]) => child === above || child === "Neck")?.[1];
      const length = end?.z ?? 0.06 * h;
      if (part === "T8") return [this.#chest(length)];
      return [barrel(this.#section(part), this.#section(above ?? part), length)];
    }
    const [near, far] = LIMBS[part] ?? [0.02, 0.02];
    const ends = span.ends.size > 0 ? [...span.ends.values()] : [this.#freeEnd(name)];
    return ends.map((end) =>
      between(roundCone(near * h, far * h, end.length()), new Vector3(), end),
    );
  }

  #section(part: string): [number, number] {
    const [depth, width] = TRUNK[part]!;
    return [depth * this.stature, width * this.stature];
  }

  #chest(length: number): BufferGeometry {
    const low = this.#section("T8");
    return barrel(low, [low[0] * 0.62, low[1] * 0.72], length * 0.94);
  }

  #head(): BufferGeometry {
    const h = this.stature;
    return new SphereGeometry(1, 36, 28)
      .scale(0.054 * h, 0.043 * h, 0.064 * h)
      .translate(0.012 * h, 0, 0.05 * h);
  }

  /** Says which way the face looks. */
  #nose(): BufferGeometry {
    const h = this.stature;
    return new SphereGeometry(1, 16, 12)
      .scale(0.011 * h, 0.0065 * h, 0.012 * h)
      .translate(0.066 * h, 0, 0.043 * h);
  }

  /** Where a segment without children ends: fingers along the arm, toes forward. */
  #freeEnd(name: string): Vector3 {
    const h = this.stature;
    if (name.endsWith("Hand"))
      return new Vector3(0, name.startsWith("Right") ? -1 : 1, 0).multiplyScalar(0.082 * h);
    if (name.endsWith("Toe")) return new Vector3(0.03 * h, 0, 0);
    return new Vector3(0, 0, 0.05 * h);
  }

  #addJoints(): void {
    const h = this.stature;
    for (const [joint, segment] of this.skeleton.segmentOfJoint) {
      const span = this.skeleton.spans.get(segment);
      if (!span) continue;
      const part = side(segment);
      const trunk = TRUNK[part];
      const radius = Math.max(0.0175, (LIMBS[part]?.[0] ?? 0.028) * 1.14) * h;
      const shape = trunk
        ? // A belt around the trunk: its joints lie inside, where no ball would be seen.
          barrel(
            [trunk[0] * h * 1.045, trunk[1] * h * 1.045],
            [trunk[0] * h * 1.045, trunk[1] * h * 1.045],
            0.001,
          ).scale(1, 1, 0.55)
        : new SphereGeometry(radius, 28, 20);
      // Unlit, so that a pixel on screen is the colour of the legend.
      const material = new MeshBasicMaterial({ toneMapped: false });
      this.#owned.push(material);
      const marker = this.#hang(shape, material, span) as Mesh<BufferGeometry, MeshBasicMaterial>;
      marker.castShadow = false;
      marker.receiveShadow = false;
      marker.visible = false;
      marker.userData["joint"] = joint;
      this.joints.set(joint, marker);
    }
  }
}
