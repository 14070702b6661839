import { LitElement, css, html, nothing } from "lit";
import { customElement, property } from "lit/decorators.js";

import {
  type Course,
  JOINTS_SHOWN,
  bandOf,
  course,
  mainLine,
  numbers,
  shadesOf,
  sizeCourse,
} from "../common/estimate-series";
import { figure } from "../common/format";
import { jointWords } from "../common/names";
import type { Playback } from "../common/playback";
import { sharedStyles } from "../common/shared-styles";
import { valueAt } from "../common/time-lookup";
import "../components/ec-chart";
import "../components/ec-hands-strip";
import type { EstimateSummary, SeriesPart } from "../data/estimate-types";
import { pageStyles } from "./page-styles";

const UNKNOWN = "cannot be told";

/** An estimate over time: payload, hands, low back and feet, or the greatest joint efforts. */
@customElement("ec-estimate-plots")
export class EcEstimatePlots extends LitElement {
  @property({ attribute: false }) estimate: EstimateSummary | null = null;
  @property({ attribute: false }) columns: SeriesPart["columns"] = {};
  @property({ attribute: false }) playback: Playback | null = null;
  /** Draws the joints instead of the rest. */
  @property({ type: Boolean }) joints = false;

  static override styles = [
    sharedStyles,
    pageStyles,
    css`
      :host {
        display: flex;
        flex-direction: column;
      }
      .key {
        display: flex;
        flex-wrap: wrap;
        gap: 0.1rem 1rem;
        font-size: 0.79rem;
        color: var(--ink-soft);
        padding: 0.1rem 0 0.25rem;
      }
      .key span::before {
        content: "";
        display: inline-block;
        width: 1.1rem;
        height: 0.55rem;
        margin-right: 0.35rem;
        vertical-align: middle;
      }
      .key .line::before {
        height: 0;
        border-top: 2px solid var(--accent);
      }
      .key .band::before {
        background: color-mix(in srgb, var(--accent) 20%, transparent);
      }
      .key .unknown::before {
        background: repeating-linear-gradient(-45deg, var(--line) 0 2px, var(--surface) 2px 6px);
      }
      .key .doubtful::before {
        background: var(--sunken);
        border: 1px solid var(--line);
      }
      .joints {
        display: grid;
        grid-template-columns: repeat(auto-fit, minmax(14.5rem, 1fr));
        gap: 0.6rem 1.2rem;
      }
      .joints ec-chart {
        height: 11rem;
      }
    `,
  ];

  override render() {
    const estimate = this.estimate;
    if (!estimate || !this.columns["time_s"]?.length) {
      return html`<p class="soft">Nothing to plot.</p>`;
    }
    return this.joints ? this.#joints(estimate) : this.#main(estimate);
  }

  #main(estimate: EstimateSummary) {
    const columns = this.columns;
    const payload = course(columns, "payload", "kg");
    const force = sizeCourse(columns, "l5s1_force", "n");
    const moment = sizeCourse(columns, "l5s1_moment", "nm");
    const many = estimate.frames > payload.times.length;
    return html`<div class="stack">
      <div class="key">
        <span class="line">median</span><span class="band">5–95 %</span>
        <span class="unknown">${UNKNOWN}</span>
        <span class="doubtful">carried over a gap</span>
        ${many ? html`<i>drawn from every ${Math.round(estimate.frames / payload.times.length)}th frame</i>` : nothing}
      </div>
      ${this.#chart("Payload, both hands together", "kg", payload, {
        tall: true,
        more: (time) => this.#hands(payload.times, time),
      })}
      <ec-hands-strip .stretches=${estimate.hands}></ec-hands-strip>
      ${this.#chart("Low back (L5–S1), force", "N", force)}
      ${this.#chart("Low back (L5–S1), moment", "N·m", moment)} ${this.#feet(payload.times)}
    </div>`;
  }

  #joints(estimate: EstimateSummary) {
    return html`<div class="joints">
      ${estimate.efforts.slice(0, JOINTS_SHOWN).map(({ joint }) =>
        this.#chart(jointWords(joint), "N·m", course(this.columns, `${joint}_effort`, "nm"), {
          axis: true,
        }),
      )}
    </div>`;
  }

  #chart(
    label: string,
    unit: string,
    of: Course,
    how: { tall?: boolean; axis?: boolean; more?: (time: number) => string } = {},
  ) {
    const reading = (time: number) => {
      const [low, middle, high] = [of.low, of.middle, of.high].map((values) =>
        valueAt(of.times, values, time),
      );
      if (!Number.isFinite(middle)) return UNKNOWN;
      const band = Number.isFinite(low) ? `  (${figure(low!)}–${figure(high!)})` : "";
      return `${figure(middle!)} ${unit}${band}${how.more?.(time) ?? ""}`;
    };
    return html`<ec-chart
      class=${how.tall ? "tall" : ""}
      label=${label}
      unit=${unit}
      ?timeAxis=${how.axis ?? false}
      .lines=${mainLine(label, of)}
      .range=${bandOf(of)}
      .shades=${shadesOf(this.columns, of.middle)}
      .playback=${this.playback}
      .reading=${reading}
    ></ec-chart>`;
  }

  /** Each hand's part, where it can be told. */
  #hands(times: number[], time: number): string {
    const parts = ["right", "left"].flatMap((side) => {
      const mass = valueAt(times, numbers(this.columns, `${side}_hand_payload_kg`), time);
      return Number.isFinite(mass) ? [`${side} ${figure(mass)}`] : [];
    });
    return parts.length === 2 ? `; ${parts.join(", ")}` : "";
  }

  #feet(times: number[]) {
    const [right, left] = ["right", "left"].map((side) =>
      numbers(this.columns, `${side}_foot_force_z_n`),
    );
    const reading = (time: number) =>
      [right!, left!]
        .map((values, index) => {
          const value = valueAt(times, values, time);
          const words = Number.isFinite(value) ? `${value.toFixed(0)} N` : "?";
          return `${index === 0 ? "right" : "left"} ${words}`;
        })
        .join(", ");
    return html`<ec-chart
      label="Feet, vertical"
      unit="N"
      timeAxis
      .lines=${[
        { label: "left", times, values: left!, kind: "compare" },
        { label: "right", times, values: right!, kind: "main" },
      ]}
      .shades=${shadesOf(this.columns, right!, left!)}
      .playback=${this.playback}
      .reading=${reading}
      ><span class="small soft">right solid, left dashed</span></ec-chart
    >`;
  }
}

declare global {
  interface HTMLElementTagNameMap {
    "ec-estimate-plots": EcEstimatePlots;
  }
}
