import { LitElement, type PropertyValues, css, html, nothing, unsafeCSS } from "lit";
import { customElement, property, query } from "lit/decorators.js";
import uPlot from "uplot";
import uPlotCss from "uplot/dist/uPlot.min.css?inline";

import type { Playback } from "../common/playback";
import { PlaybackController } from "../common/playback-controller";
import { sharedStyles } from "../common/shared-styles";
import { type Line, type Range, type Shade, type Zone, chartData } from "./chart-series";
import { drawShades } from "./chart-shades";

const AXIS_WIDTH = 48;

/**
 * A quantity over time with its band, tied to the page's clock: a click or a drag sets the time.
 *
 * Only its playhead moves while playing; the curves are drawn once.
 */
@customElement("ec-chart")
export class EcChart extends LitElement {
  @property() label = "";
  /** Unit on the value axis; empty for a score. */
  @property() unit = "";
  @property({ attribute: false }) lines: Line[] = [];
  @property({ attribute: false }) range: Range | null = null;
  @property({ attribute: false }) zones: Zone[] = [];
  /** Stretches of time in which the value is not known, or doubtful. */
  @property({ attribute: false }) shades: Shade[] = [];
  /** Ends of the value axis; from the data where not given. */
  @property({ attribute: false }) limits: [number, number] | null = null;
  /** Values at which the axis is marked; chosen by the plot where not given. */
  @property({ attribute: false }) ticks: number[] | null = null;
  /** Times to mark on the curve. */
  @property({ attribute: false }) marks: number[] = [];
  @property({ attribute: false }) playback: Playback | null = null;
  /** Writes the time axis below; the lowest of a stack of charts does. */
  @property({ type: Boolean }) timeAxis = false;
  /** Value at the clock's time, already in words. */
  @property({ attribute: false }) reading: ((time: number) => string) | null = null;

  @query(".plot") private plot!: HTMLElement;
  @query(".head") private head!: HTMLElement;
  @query("output") private output!: HTMLOutputElement;

  #chart: uPlot | null = null;
  #resize = new ResizeObserver(() => this.#fit());
  #scheme = matchMedia("(prefers-color-scheme: dark)");
  #dragging = false;

  constructor() {
    super();
    new PlaybackController(
      this,
      () => this.playback,
      () => this.#move(),
    );
  }

  static override styles = [
    unsafeCSS(uPlotCss),
    sharedStyles,
    css`
      :host {
        display: flex;
        flex-direction: column;
        min-width: 0;
        min-height: 0;
      }
      .title {
        display: flex;
        align-items: baseline;
        flex-wrap: wrap;
        gap: 0 0.5rem;
        min-height: 1.5rem;
      }
      .title h3 {
        font-size: 0.86rem;
        font-weight: 560;
        white-space: nowrap;
      }
      output {
        margin-left: auto;
        font-size: 0.86rem;
        white-space: nowrap;
      }
      .plot {
        position: relative;
        flex: 1;
        min-height: 60px;
        cursor: crosshair;
        touch-action: pan-y;
        overflow: hidden;
      }
      .head {
        position: absolute;
        top: 0;
        width: 0;
        border-left: 1.5px solid var(--ink);
        opacity: 0.7;
        pointer-events: none;
      }
      .none {
        position: absolute;
        inset: 0;
        display: grid;
        place-items: center;
      }
      .u-select,
      .u-cursor-x,
      .u-cursor-y {
        display: none;
      }
      .uplot {
        width: auto;
      }
    `,
  ];

  override render() {
    return html`
      <div class="title">
        <h3>${this.label}</h3>
        <slot></slot>
        <output class="number soft"></output>
      </div>
      <div
        class="plot"
        role="img"
        aria-label=${this.#summary()}
        @pointerdown=${this.#onDown}
        @pointermove=${this.#onMove}
        @pointerup=${this.#onUp}
        @pointercancel=${this.#onUp}
      >
        <div class="head" hidden></div>
        ${
          this.lines.length > 0 && !this.#known().length
            ? html`<p class="none soft small">Cannot be told from what was measured.</p>`
            : nothing
        }
      </div>
    `;
  }

  override connectedCallback(): void {
    super.connectedCallback();
    this.#scheme.addEventListener("change", this.#redraw);
  }

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    this.#scheme.removeEventListener("change", this.#redraw);
    this.#resize.disconnect();
    this.#chart?.destroy();
    this.#chart = null;
  }

  override firstUpdated(): void {
    this.#resize.observe(this.plot);
  }

  override updated(changed: PropertyValues<this>): void {
    if (changed.size > 1 || !changed.has("reading")) this.#build();
    this.#move();
  }

  #summary(): string {
    const known = this.#known();
    if (known.length === 0) return `${this.label}: no data`;
    const low = known.reduce((a, b) => Math.min(a, b)).toFixed(1);
    const high = known.reduce((a, b) => Math.max(a, b)).toFixed(1);
    return `${this.label} over time, from ${low} to ${high} ${this.unit}`;
  }

  /** Values of the answer wherever there are any. */
  #known(): number[] {
    const main = this.lines.find((line) => line.kind === "main");
    return main ? main.values.filter((value) => Number.isFinite(value)) : [];
  }

  #colour(name: string): string {
    return getComputedStyle(this).getPropertyValue(name).trim();
  }

  #redraw = (): void => this.#build();

  #build(): void {
    this.#chart?.destroy();
    this.#chart = null;
    const { clientWidth: width, clientHeight: height } = this.plot;
    if (width < 20 || height < 20 || this.lines.length === 0) return;
    const { lines, columns } = chartData(this.lines, this.range);
    const soft = this.#colour("--ink-soft");
    const grid = { stroke: this.#colour("--line"), width: 1 };
    const font = "11px " + this.#colour("--font");
    const ticks = this.ticks;
    const options: uPlot.Options = {
      width,
      height,
      legend: { show: false },
      cursor: { show: false },
      padding: [6, 8, this.timeAxis ? 0 : 4, 0],
      scales: {
        x: { time: false, range: () => this.#timeRange(columns[0]) },
        y: {
          range: (_, low, high) =>
            this.limits ?? [
              Math.min(0, low),
              high <= 0 ? 1 : high + 0.08 * (high - Math.min(0, low)),
            ],
        },
      },
      axes: [
        {
          show: this.timeAxis,
          stroke: soft,
          font,
          grid: { show: false },
          ticks: { show: false },
          size: 24,
          gap: 4,
          values: (_, values) =>
            values.map((value, index) =>
              index === values.length - 1 ? `${value} s` : String(value),
            ),
        },
        {
          stroke: soft,
          font,
          grid,
          ticks: { show: false },
          size: AXIS_WIDTH,
          gap: 6,
          space: 22,
          ...(ticks ? { splits: () => ticks } : {}),
          values: (_, values) =>
            values.map((value, index) =>
              index === values.length - 1 && this.unit ? `${value} ${this.unit}` : String(value),
            ),
        },
      ],
      series: [{}, ...lines.map((line) => this.#series(line))],
      bands: this.range
        ? [{ series: [1, 2], fill: withAlpha(this.#colour("--accent"), 0.17) }]
        : [],
      hooks: {
        drawClear: [
          (u) => drawShades(u, this.shades, this.#colour("--line"), this.#colour("--sunken")),
          (u) => this.#drawZones(u),
        ],
        draw: [
          (u) => {
            this.#drawZoneLabels(u);
            this.#drawMarks(u);
            // Only now are the scales settled, on which the playhead's place depends.
            this.#move();
          },
        ],
      },
    };
    this.#chart = new uPlot(options, columns as uPlot.AlignedData, this.plot);
    this.plot.prepend(this.#chart.root);
  }

  #series(line: Line): uPlot.Series {
    const base: uPlot.Series = { label: line.label, points: { show: false }, spanGaps: false };
    const paths = line.stepped ? uPlot.paths.stepped!({ align: 1 }) : undefined;
    const looks = {
      main: { stroke: this.#colour("--accent"), width: 2 },
      compare: { stroke: this.#colour("--ink-soft"), width: 1.2, dash: [4, 3] },
      edge: { stroke: "transparent", width: 0 },
    };
    return { ...base, ...looks[line.kind], ...(paths ? { paths } : {}) };
  }

  #timeRange(times: readonly number[]): [number, number] {
    if (this.playback && this.playback.duration > 0) {
      return [this.playback.start, this.playback.end];
    }
    return [times[0] ?? 0, times[times.length - 1] ?? 1];
  }

  #drawZones(u: uPlot): void {
    const { left, width } = u.bbox;
    for (const zone of this.zones) {
      const [top, bottom] = zoneEnds(u, zone);
      u.ctx.fillStyle = this.#colour(zone.colour) || "transparent";
      u.ctx.fillRect(left, top, width, bottom - top);
    }
  }

  /** Written over the curves with a rim, so that neither hides the other. */
  #drawZoneLabels(u: uPlot): void {
    const pen = u.ctx;
    pen.save();
    pen.textAlign = "right";
    pen.textBaseline = "top";
    pen.font = `${10 * devicePixelRatio}px ${this.#colour("--font")}`;
    pen.lineWidth = 3 * devicePixelRatio;
    pen.strokeStyle = this.#colour("--surface");
    pen.globalAlpha = 0.85;
    pen.fillStyle = this.#colour("--ink-soft");
    const right = u.bbox.left + u.bbox.width - 6 * devicePixelRatio;
    for (const zone of this.zones) {
      const [top, bottom] = zoneEnds(u, zone);
      if (bottom - top < 11 * devicePixelRatio) continue;
      const y = top + 2 * devicePixelRatio;
      pen.strokeText(zone.label, right, y);
      pen.fillText(zone.label, right, y);
    }
    pen.restore();
  }

  #drawMarks(u: uPlot): void {
    const pen = u.ctx;
    const { top, height } = u.bbox;
    pen.save();
    pen.fillStyle = this.#colour("--ink");
    const size = 4 * devicePixelRatio;
    for (const mark of this.marks) {
      const x = u.valToPos(mark, "x", true);
      pen.beginPath();
      pen.moveTo(x - size, top + height + size * 0.6);
      pen.lineTo(x + size, top + height + size * 0.6);
      pen.lineTo(x, top + height - size);
      pen.fill();
    }
    pen.restore();
  }

  #fit(): void {
    const { clientWidth: width, clientHeight: height } = this.plot;
    if (width < 20 || height < 20) return;
    if (this.#chart) this.#chart.setSize({ width, height });
    else this.#build();
    this.#move();
  }

  #move(): void {
    if (!this.hasUpdated) return;
    const time = this.playback?.time ?? 0;
    this.output.textContent = this.reading ? this.reading(time) : "";
    this.head.hidden = !this.#chart || !this.playback;
    if (!this.#chart || !this.playback) return;
    const { left, width, height } = this.#chart.bbox;
    const x = this.#chart.valToPos(time, "x");
    const ratio = devicePixelRatio;
    this.head.style.height = `${(height + this.#chart.bbox.top) / ratio}px`;
    this.head.style.transform = `translateX(${Math.min(Math.max(0, x), width / ratio) + left / ratio}px)`;
  }

  #seek(event: PointerEvent): void {
    if (!this.#chart || !this.playback) return;
    const bounds = this.plot.getBoundingClientRect();
    const left = this.#chart.bbox.left / devicePixelRatio;
    this.playback.seek(this.#chart.posToVal(event.clientX - bounds.left - left, "x"));
  }

  #onDown(event: PointerEvent): void {
    this.#dragging = true;
    this.plot.setPointerCapture(event.pointerId);
    this.#seek(event);
  }

  #onMove(event: PointerEvent): void {
    if (this.#dragging) this.#seek(event);
  }

  #onUp(): void {
    this.#dragging = false;
  }
}

/** Upper and lower end of a zone on the canvas, kept inside the plot. */
function zoneEnds(u: uPlot, zone: Zone): [number, number] {
  const { top, height } = u.bbox;
  const inside = (value: number) =>
    Math.min(top + height, Math.max(top, u.valToPos(value, "y", true)));
  return [inside(zone.to), inside(zone.from)];
}

/** A colour with another opacity, by the canvas's own colour mixing. */
function withAlpha(colour: string, alpha: number): string {
  return `color-mix(in srgb, ${colour} ${alpha * 100}%, transparent)`;
}

declare global {
  interface HTMLElementTagNameMap {
    "ec-chart": EcChart;
  }
}
