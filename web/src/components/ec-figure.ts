import { LitElement, type PropertyValues, css, html, nothing } from "lit";
import { customElement, property, query, state } from "lit/decorators.js";
import { Box3, Color, Object3D, Raycaster, SRGBColorSpace, Vector2, Vector3 } from "three";

import { rampColour } from "../common/colour-ramp";
import { figure } from "../common/format";
import { jointWords } from "../common/names";
import type { Playback } from "../common/playback";
import { PlaybackController } from "../common/playback-controller";
import { sharedStyles } from "../common/shared-styles";
import { placeOf, valueAt } from "../common/time-lookup";
import type { Posture } from "../data/types";
import { HandPath } from "../figure/hand-path";
import { frameAt } from "../figure/interpolate";
import { Mannequin } from "../figure/mannequin";
import { Skeleton } from "../figure/skeleton";
import { Stage } from "../figure/stage";

const ORBIT_STEP = Math.PI / 18;
/** Distance of the label from its joint, CSS pixels. */
const LABEL_GAP = 64;
/** How far its leader stops short of the joint. */
const LABEL_SHORT = 14;

/**
 * The person in 3-D, at the time of the page's clock, joints coloured by effort.
 *
 * @fires joint-select `detail` is the joint that was clicked.
 */
@customElement("ec-figure")
export class EcFigure extends LitElement {
  /** URDF text of the person's model. */
  @property({ attribute: false }) urdf = "";
  @property({ attribute: false }) posture: Posture | null = null;
  @property({ attribute: false }) playback: Playback | null = null;
  /** Draws the other samples of the prediction faintly. */
  @property({ type: Boolean }) spread = false;
  /** Joint whose effort is written beside it. */
  @property() joint: string | null = null;
  /** Side from which the body is looked at first: that of the hand that works. */
  @property() hand: "right" | "left" = "right";

  @state() private failure: string | null = null;
  @query("canvas") private canvas!: HTMLCanvasElement;
  @query(".label") private label!: HTMLElement | null;

  #stage: Stage | null = null;
  #person: Mannequin | null = null;
  #ghosts: Mannequin[] = [];
  #path: HandPath | null = null;
  #resize: ResizeObserver | null = null;
  #scheme = matchMedia("(prefers-color-scheme: dark)");
  #framedFor: string | null = null;

  constructor() {
    super();
    new PlaybackController(
      this,
      () => this.playback,
      () => this.#pose(),
    );
  }

  static override styles = [
    sharedStyles,
    css`
      :host {
        display: block;
        position: relative;
        overflow: hidden;
        background: var(--sky);
      }
      canvas {
        display: block;
        width: 100%;
        height: 100%;
      }
      canvas:focus-visible {
        outline-offset: -3px;
      }
      .label {
        position: absolute;
        left: 0;
        top: 0;
        pointer-events: none;
        white-space: nowrap;
        font-size: 0.86rem;
        padding: 0.12rem 0.5rem;
        border-radius: 6px;
        background: var(--surface);
        border: 1px solid var(--line);
        box-shadow: var(--shadow);
      }
      .label::after {
        content: "";
        position: absolute;
        top: 50%;
        right: 100%;
        width: var(--leader, 50px);
        border-top: 1px solid var(--ink-soft);
      }
      .label.left::after {
        right: auto;
        left: 100%;
      }
      .failure {
        position: absolute;
        inset: 0;
        display: grid;
        place-items: center;
        padding: 1.5rem;
        text-align: center;
        color: var(--ink-soft);
      }
    `,
  ];

  override render() {
    return html`
      <canvas
        tabindex="0"
        aria-label="The person in 3-D. Shift and arrow keys turn the view."
        @keydown=${this.#onKey}
        @click=${this.#onClick}
        @dblclick=${() => this.resetView()}
      ></canvas>
      ${
        this.joint && this.#effortOf(this.joint) !== null
          ? html`<div class="label number"></div>`
          : nothing
      }
      ${this.failure ? html`<div class="failure">${this.failure}</div>` : nothing}
    `;
  }

  override firstUpdated(): void {
    try {
      this.#stage = new Stage(this.canvas, () => this.#placeLabel());
    } catch {
      this.failure = "This browser cannot draw in 3-D (WebGL is off). The plots still tell it all.";
      return;
    }
    this.#resize = new ResizeObserver(() => {
      this.#stage?.resize(this.clientWidth, this.clientHeight);
      if (this.#framedFor === "unsized") this.#frameOnce();
    });
    this.#resize.observe(this);
    this.#scheme.addEventListener("change", this.#recolour);
    this.#recolour();
  }

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    this.#resize?.disconnect();
    this.#scheme.removeEventListener("change", this.#recolour);
    this.#clear();
    this.#stage?.dispose();
    this.#stage = null;
  }

  override updated(changed: PropertyValues<this>): void {
    if (!this.#stage) return;
    if (changed.has("urdf") || changed.has("posture")) this.#build();
    else if (changed.has("spread")) this.#buildGhosts();
    if (changed.size > 0) this.#pose();
  }

  /** Looks at the body afresh, from the front and the side of the working hand. */
  resetView(): void {
    this.#framedFor = null;
    this.#frameOnce();
  }

  /** Angle of one degree of freedom as drawn, radians; for tests. */
  angleOf(dof: string): number | null {
    return this.#person?.skeleton.robot.joints[dof]?.angle ?? null;
  }

  /** Place of a joint as drawn, metres in the world; for tests. */
  placeOf(joint: string): [number, number, number] | null {
    const marker = this.#person?.joints.get(joint);
    return marker ? marker.getWorldPosition(new Vector3()).toArray() : null;
  }

  /** Colour of a joint's marker as sRGB bytes, null while it is hidden; for tests. */
  colourOf(joint: string): [number, number, number] | null {
    const marker = this.#person?.joints.get(joint);
    if (!marker?.visible) return null;
    const { r, g, b } = marker.material.color.getRGB({ r: 0, g: 0, b: 0 }, SRGBColorSpace);
    return [r, g, b].map((channel) => Math.round(channel * 255)) as [number, number, number];
  }

  /** Pixel of the finished picture at a joint, sRGB bytes; for tests. */
  pixelAt(joint: string): [number, number, number] | null {
    const marker = this.#person?.joints.get(joint);
    const place = marker && this.#stage?.project(marker);
    return place ? this.pixelOf(place.x, place.y) : null;
  }

  /** Pixel of the finished picture at a place in CSS pixels, sRGB bytes; for tests. */
  pixelOf(x: number, y: number): [number, number, number] {
    this.#stage?.drawNow();
    const copy = document.createElement("canvas");
    copy.width = this.canvas.width;
    copy.height = this.canvas.height;
    const pen = copy.getContext("2d")!;
    pen.drawImage(this.canvas, 0, 0);
    const scale = this.canvas.width / this.canvas.clientWidth;
    const data = pen.getImageData(x * scale, y * scale, 1, 1).data;
    return [data[0]!, data[1]!, data[2]!];
  }

  /** Number of pictures drawn so far; for tests. */
  get drawn(): number {
    return this.#stage?.drawn ?? 0;
  }

  /** Number of faint samples shown; for tests. */
  get ghostCount(): number {
    return this.#ghosts.length;
  }

  #clear(): void {
    this.#person?.dispose();
    this.#person = null;
    for (const ghost of this.#ghosts) ghost.dispose();
    this.#ghosts = [];
    this.#path?.dispose();
    this.#path = null;
  }

  #build(): void {
    this.#clear();
    const stage = this.#stage!;
    if (!this.urdf || !this.posture) {
      stage.draw();
      return;
    }
    this.#person = new Mannequin(new Skeleton(this.urdf));
    this.#person.skeleton.addTo(stage.scene);
    if (this.posture.target?.position_m.length) {
      this.#path = new HandPath(this.posture.target.position_m);
      stage.scene.add(this.#path.group);
    }
    this.#buildGhosts();
    this.#recolour();
    this.#pose();
    this.#frameOnce();
  }

  #buildGhosts(): void {
    for (const ghost of this.#ghosts) ghost.dispose();
    const samples = this.spread && this.#person ? (this.posture?.samples ?? []) : [];
    this.#ghosts = samples.map(() => new Mannequin(new Skeleton(this.urdf), true));
    for (const ghost of this.#ghosts) ghost.skeleton.addTo(this.#stage!.scene);
    this.#recolour();
  }

  /** Sets body, ghosts, path and colours to the clock's time. */
  #pose(): void {
    const posture = this.posture;
    const stage = this.#stage;
    if (!posture || !stage || !this.#person) return;
    const time = this.playback?.time ?? posture.time_s[0]!;
    [this.#person, ...this.#ghosts].forEach((body, index) => {
      const frame = frameAt(posture, time, index === 0 ? undefined : index - 1);
      body.skeleton.setPosture(posture.joint_names, frame.jointPosition);
      body.skeleton.robot.position.set(...frame.basePosition);
      body.skeleton.robot.quaternion.set(...frame.baseOrientation);
    });
    stage.follow(this.#person.skeleton.robot.position);
    const place = placeOf(posture.time_s, time);
    this.#path?.setProgress(
      (place.index + place.fraction) / Math.max(1, posture.time_s.length - 1),
    );
    for (const joint of this.#person.joints.keys()) {
      const effort = this.#effortOf(joint);
      const scale = posture.effort_scale_nm?.[joint] ?? 0;
      if (effort === null || scale <= 0) this.#person.setJointColour(joint, null);
      else {
        const [r, g, b] = rampColour(effort / scale);
        const colour = new Color().setRGB(r / 255, g / 255, b / 255, SRGBColorSpace);
        this.#person.setJointColour(joint, colour);
      }
    }
    this.#person.skeleton.robot.updateMatrixWorld(true);
    stage.draw();
  }

  #effortOf(joint: string): number | null {
    const efforts = this.posture?.effort_p50_nm?.[joint];
    if (!this.posture || !efforts) return null;
    const effort = valueAt(this.posture.time_s, efforts, this.playback?.time ?? 0);
    return Number.isNaN(effort) ? null : effort;
  }

  /** Frames body and path once per model, so that changing candidates keeps the view. */
  #frameOnce(): void {
    const stage = this.#stage;
    if (!stage || !this.#person || !this.posture) return;
    if (this.clientWidth < 2) {
      this.#framedFor = "unsized";
      return;
    }
    const key = this.urdf;
    if (this.#framedFor === key) return;
    this.#framedFor = key;
    const robot = this.#person.skeleton.robot;
    const bounds = new Box3().setFromObject(robot);
    const box = bounds.clone();
    // Whoever bends at first will stand up: leave room for the whole stature.
    const crown = bounds.min.z + this.#person.stature;
    box.expandByPoint(new Vector3(robot.position.x, robot.position.y, crown));
    for (const [x, y, z] of this.posture.target?.position_m ?? []) {
      box.expandByPoint(new Vector3(x, y, z));
    }
    stage.setFloor(Math.abs(bounds.min.z) < 0.3 ? 0 : bounds.min.z);
    const forward = new Vector3(1, 0, 0).applyQuaternion(robot.quaternion);
    const heading = Math.atan2(forward.y, forward.x);
    stage.frame(box, heading + (this.hand === "right" ? -1 : 1) * 0.95);
  }

  #placeLabel(): void {
    const label = this.label;
    const marker = this.joint ? this.#person?.joints.get(this.joint) : undefined;
    if (!label || !marker || !this.joint) return;
    const place = this.#stage?.project(marker);
    const effort = this.#effortOf(this.joint);
    label.hidden = !place || effort === null;
    if (!place || effort === null) return;
    label.textContent = `${jointWords(this.joint)} ${figure(effort)} N·m`;
    // Behind the back, where no arm works.
    const left = this.#facesRight();
    const reach = LABEL_GAP + label.offsetWidth;
    const x = left ? place.x - reach : place.x + LABEL_GAP;
    const y = Math.min(Math.max(place.y - label.offsetHeight / 2, 8), this.clientHeight - 34);
    const inside = Math.min(Math.max(8, x), this.clientWidth - label.offsetWidth - 8);
    label.classList.toggle("left", left);
    const gap = left ? place.x - inside - label.offsetWidth : inside - place.x;
    label.style.setProperty("--leader", `${Math.max(0, gap - LABEL_SHORT)}px`);
    label.style.transform = `translate(${inside}px, ${y}px)`;
  }

  /** Whether the person looks to the right in the picture. */
  #facesRight(): boolean {
    const robot = this.#person?.skeleton.robot;
    if (!robot || !this.#stage) return true;
    const ahead = new Object3D();
    robot.localToWorld(ahead.position.set(0.5, 0, 0));
    ahead.updateMatrixWorld();
    const here = this.#stage.project(robot);
    const there = this.#stage.project(ahead);
    return !here || !there || there.x >= here.x;
  }

  #recolour = (): void => {
    const style = getComputedStyle(this);
    const value = (name: string) => style.getPropertyValue(name).trim();
    this.#stage?.setColours({
      sky: value("--sky"),
      floor: value("--floor"),
      grid: value("--grid"),
    });
    this.#person?.setSkin(new Color(value("--body")));
    for (const ghost of this.#ghosts) ghost.setSkin(new Color(value("--ghost")));
    this.#path?.setColour(new Color(value("--accent")));
    this.#stage?.draw();
  };

  #onKey(event: KeyboardEvent): void {
    const turns: Record<string, [number, number]> = {
      ArrowLeft: [-1, 0],
      ArrowRight: [1, 0],
      ArrowUp: [0, -1],
      ArrowDown: [0, 1],
    };
    const turn = event.shiftKey ? turns[event.key] : undefined;
    if (!turn || !this.#stage) return;
    const { camera, controls } = this.#stage;
    const offset = camera.position.clone().sub(controls.target);
    offset.applyAxisAngle(new Vector3(0, 0, 1), turn[0] * ORBIT_STEP);
    const across = new Vector3(0, 0, 1).cross(offset).normalize();
    const tipped = offset.clone().applyAxisAngle(across, turn[1] * ORBIT_STEP);
    if (Math.hypot(tipped.x, tipped.y) > 0.1 * tipped.length()) offset.copy(tipped);
    camera.position.copy(controls.target).add(offset);
    controls.update();
    event.preventDefault();
    event.stopPropagation();
  }

  #onClick(event: MouseEvent): void {
    if (!this.#stage || !this.#person) return;
    const bounds = this.canvas.getBoundingClientRect();
    const pointer = new Vector2(
      ((event.clientX - bounds.left) / bounds.width) * 2 - 1,
      1 - ((event.clientY - bounds.top) / bounds.height) * 2,
    );
    const ray = new Raycaster();
    ray.setFromCamera(pointer, this.#stage.camera);
    const visible = [...this.#person.joints.values()].filter((marker) => marker.visible);
    const hit = ray.intersectObjects(visible, false)[0];
    const joint: unknown = hit?.object.userData["joint"];
    if (typeof joint !== "string") return;
    this.dispatchEvent(
      new CustomEvent("joint-select", { detail: joint, bubbles: true, composed: true }),
    );
  }
}

declare global {
  interface HTMLElementTagNameMap {
    "ec-figure": EcFigure;
  }
}
