import { type Object3D, type Scene, Vector3 } from "three";
import URDFLoader, { type URDFRobot } from "urdf-loader";

/** Where a segment's shape reaches, in its own frame at the zero posture. */
export interface SegmentSpan {
  link: Object3D;
  /** Origins of the segments that hang from it. */
  ends: Map<string, Vector3>;
}

/**
 * The person's model from its URDF: the joints that move it and the spans its shapes are built on.
 *
 * A spherical joint `jX` is three revolutes `jX_rotx`, `jX_roty`, `jX_rotz`.
 */
export class Skeleton {
  readonly robot: URDFRobot;
  readonly spans = new Map<string, SegmentSpan>();
  /** Segment that each spherical joint moves. */
  readonly segmentOfJoint = new Map<string, string>();

  constructor(urdf: string) {
    const loader = new URDFLoader();
    loader.parseVisual = false;
    loader.parseCollision = false;
    this.robot = loader.parse(urdf);
    this.robot.updateMatrixWorld(true);
    for (const [name, joint] of Object.entries(this.robot.joints)) {
      // A recorded posture is shown as it was, even where it passes a textbook limit.
      joint.ignoreLimits = true;
      const last = /^(j\w+)_rotz$/.exec(name);
      const child = Object.keys(this.robot.links).find(
        (link) => this.robot.links[link]!.parent === joint,
      );
      if (last && child) this.segmentOfJoint.set(last[1]!, child);
    }
    for (const name of [this.#baseName(), ...this.segmentOfJoint.values()]) {
      this.spans.set(name, { link: this.robot.links[name]!, ends: new Map() });
    }
    for (const segment of this.segmentOfJoint.values()) {
      const parent = this.#parentOf(segment);
      const span = parent === null ? undefined : this.spans.get(parent);
      const link = this.robot.links[segment]!;
      span?.ends.set(segment, span.link.worldToLocal(link.getWorldPosition(new Vector3())));
    }
  }

  /** Distance between the lowest and highest joint at the zero posture, in metres. */
  get span(): number {
    let low = Infinity;
    let high = -Infinity;
    for (const { link } of this.spans.values()) {
      const z = link.getWorldPosition(new Vector3()).z;
      low = Math.min(low, z);
      high = Math.max(high, z);
    }
    return high - low;
  }

  addTo(scene: Scene): void {
    scene.add(this.robot);
  }

  /** Sets every named joint; unknown names are ignored, since a model may have fewer. */
  setPosture(names: readonly string[], values: ArrayLike<number>): void {
    names.forEach((name, index) => this.robot.joints[name]?.setJointValue(values[index]!));
  }

  #baseName(): string {
    if ("Pelvis" in this.robot.links) return "Pelvis";
    return Object.keys(this.robot.links)[0]!;
  }

  #parentOf(segment: string): string | null {
    let node: Object3D | null = this.robot.links[segment]!.parent;
    while (node) {
      for (const [name, span] of this.spans) if (span.link === node) return name;
      node = node.parent;
    }
    return null;
  }
}
