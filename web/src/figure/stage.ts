import {
  Box3,
  CircleGeometry,
  Color,
  DirectionalLight,
  Fog,
  GridHelper,
  HemisphereLight,
  Mesh,
  MeshStandardMaterial,
  Object3D,
  PCFShadowMap,
  PerspectiveCamera,
  Scene,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";

/** Colours of the scene, read from the page's CSS variables. */
export interface StageColours {
  sky: string;
  floor: string;
  grid: string;
}

/** The room the body stands in: camera, light and floor, z up, drawn only when something changed. */
export class Stage {
  readonly scene = new Scene();
  readonly camera = new PerspectiveCamera(32, 1, 0.05, 60);
  readonly renderer: WebGLRenderer;
  readonly controls: OrbitControls;
  readonly #floor: Mesh<CircleGeometry, MeshStandardMaterial>;
  #grid: GridHelper | null = null;
  readonly #sun = new DirectionalLight(0xffffff, 2.1);
  readonly #followed = new Vector3();
  #pending = 0;
  /** Number of pictures drawn so far. */
  drawn = 0;

  constructor(
    canvas: HTMLCanvasElement,
    private readonly onDraw: () => void,
  ) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true });
    this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio));
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enablePan = true;
    this.controls.maxPolarAngle = Math.PI * 0.53;
    this.controls.minDistance = 0.6;
    this.controls.maxDistance = 12;
    // A page that scrolls must go on scrolling over the picture on a phone.
    canvas.style.touchAction = "pan-y";
    this.controls.addEventListener("change", () => this.draw());
    this.#floor = new Mesh(
      new CircleGeometry(12, 64),
      new MeshStandardMaterial({ roughness: 1, metalness: 0 }),
    );
    this.#floor.receiveShadow = true;
    this.#sun.castShadow = true;
    this.#sun.shadow.mapSize.set(1024, 1024);
    this.#sun.shadow.radius = 5;
    this.#sun.shadow.camera.left = this.#sun.shadow.camera.bottom = -2;
    this.#sun.shadow.camera.right = this.#sun.shadow.camera.top = 2;
    this.scene.add(this.#floor, this.#sun, this.#sun.target);
    this.scene.add(new HemisphereLight(0xffffff, 0xaab4bd, 1.9));
  }

  setColours(colours: StageColours): void {
    const sky = new Color(colours.sky);
    this.scene.background = sky;
    this.scene.fog = new Fog(sky, 6, 14);
    this.#floor.material.color.set(colours.floor);
    const height = this.#floor.position.z;
    this.#grid?.removeFromParent();
    this.#grid?.dispose();
    this.#grid = new GridHelper(24, 48, colours.grid, colours.grid);
    this.#grid.rotateX(Math.PI / 2);
    this.#grid.position.z = height + 0.001;
    this.scene.add(this.#grid);
    this.draw();
  }

  setFloor(height: number): void {
    this.#floor.position.z = height;
    if (this.#grid) this.#grid.position.z = height + 0.001;
  }

  /** Keeps camera, light and shadow with a body that walks; the view onto it stays as it was turned. */
  follow(position: Vector3): void {
    const step = new Vector3(position.x - this.#followed.x, position.y - this.#followed.y, 0);
    this.#followed.copy(position);
    this.camera.position.add(step);
    this.controls.target.add(step);
    this.controls.update();
    this.#sun.position.copy(position).add(new Vector3(1.2, -1.6, 3.2));
    this.#sun.target.position.copy(position);
  }

  /**
   * Frames a box from in front and to one side.
   *
   * @param azimuth Direction of the camera about z, from the world's x axis, in radians.
   */
  frame(box: Box3, azimuth: number): void {
    const centre = box.getCenter(new Vector3());
    const size = box.getSize(new Vector3());
    const tall = size.z;
    const wide = Math.hypot(size.x, size.y) * 0.8;
    const half = Math.tan(((this.camera.fov / 2) * Math.PI) / 180);
    const distance =
      1.12 * Math.max(tall / 2 / half, wide / 2 / (half * this.camera.aspect)) + wide / 4;
    this.controls.target.copy(centre);
    this.camera.position
      .set(Math.cos(azimuth), Math.sin(azimuth), 0.28)
      .normalize()
      .multiplyScalar(distance)
      .add(centre);
    this.controls.update();
    this.draw();
  }

  resize(width: number, height: number): void {
    if (width < 1 || height < 1) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  /** Draws at the next frame of the screen, however often it is asked to. */
  draw(): void {
    if (this.#pending) return;
    this.#pending = requestAnimationFrame(() => {
      this.#pending = 0;
      this.drawNow();
    });
  }

  drawNow(): void {
    this.renderer.render(this.scene, this.camera);
    this.drawn += 1;
    this.onDraw();
  }

  /** Where a point of the scene falls on the picture, in CSS pixels; null behind the camera. */
  project(object: Object3D): { x: number; y: number } | null {
    const point = object.getWorldPosition(new Vector3()).project(this.camera);
    if (point.z > 1) return null;
    const { clientWidth, clientHeight } = this.renderer.domElement;
    return { x: ((point.x + 1) / 2) * clientWidth, y: ((1 - point.y) / 2) * clientHeight };
  }

  dispose(): void {
    cancelAnimationFrame(this.#pending);
    this.controls.dispose();
    this.renderer.dispose();
  }
}
