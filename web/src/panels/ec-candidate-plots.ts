import { LitElement, css, html, nothing } from "lit";
import { customElement, property, state } from "lit/decorators.js";

import { atLeast } from "../common/distributions";
import { figure, percent } from "../common/format";
import { distinctMoments } from "../common/moment-words";
import { compareJoints, jointWords } from "../common/names";
import type { Playback } from "../common/playback";
import {
  REBA_LIMITS,
  REBA_TICKS,
  REBA_ZONES,
  RULA_LIMITS,
  RULA_TICKS,
  RULA_ZONES,
} from "../common/score-zones";
import { sharedStyles } from "../common/shared-styles";
import { valueAt } from "../common/time-lookup";
import type { Line } from "../components/chart-series";
import "../components/ec-chart";
import type { Band, Candidate, ScoreBand } from "../data/types";
import { pageStyles } from "./page-styles";

type Score = "rula" | "reba";

const PERCENT_ZONES = [{ from: 50, to: 100, colour: "--zone-3", label: "more likely than not" }];

/**
 * The scores, the back and one joint's effort of a candidate over time, each with its band.
 *
 * @fires joint-select `detail` is the joint chosen from the list.
 */
@customElement("ec-candidate-plots")
export class EcCandidatePlots extends LitElement {
  @property({ attribute: false }) candidate: Candidate | null = null;
  /** Another candidate, drawn dashed. */
  @property({ attribute: false }) compare: Candidate | null = null;
  @property() joint: string | null = null;
  @property({ attribute: false }) playback: Playback | null = null;

  @state() private score: Score = "rula";

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
        gap: 1rem;
        font-size: 0.79rem;
        color: var(--ink-soft);
        padding: 0.1rem 0 0.25rem;
      }
      .key span::before {
        content: "";
        display: inline-block;
        width: 1.1rem;
        border-top: 2px solid var(--accent);
        margin-right: 0.35rem;
        vertical-align: middle;
      }
      .key .band::before {
        border-top: 8px solid color-mix(in srgb, var(--accent) 20%, transparent);
      }
      .key .other::before {
        border-top: 1.5px dashed var(--ink-soft);
      }
    `,
  ];

  override render() {
    const candidate = this.candidate;
    if (!candidate?.rula) {
      return html`<div class="stack"><p class="soft">Nothing to plot for this one.</p></div>`;
    }
    return html`
      <div class="stack">
        <div class="key">
          <span>expected</span><span class="band">5–95 %</span>
          ${this.compare ? html`<span class="other">${this.compare.id}</span>` : nothing}
        </div>
        ${this.#scoreChart(candidate)} ${this.#highChart(candidate)} ${this.#backChart(candidate)}
        ${this.#effortChart(candidate)}
      </div>
    `;
  }

  get #marks(): number[] {
    return distinctMoments(this.candidate?.moments ?? []).map((moment) => moment.time_s);
  }

  #scoreChart(candidate: Candidate) {
    const band = this.#band(candidate);
    if (!band) return nothing;
    const other = this.compare && this.#band(this.compare);
    const rula = this.score === "rula";
    return html`<ec-chart
      class="tall"
      label=""
      .lines=${lines(band.time_s, band.expected, other?.time_s, other?.expected)}
      .range=${{ label: "5–95 %", times: band.time_s, low: band.p05, high: band.p95 }}
      .zones=${rula ? RULA_ZONES : REBA_ZONES}
      .limits=${rula ? RULA_LIMITS : REBA_LIMITS}
      .ticks=${rula ? RULA_TICKS : REBA_TICKS}
      .marks=${this.#marks}
      .playback=${this.playback}
      .reading=${(time: number) =>
        `${at(band, band.expected, time).toFixed(1)}  (${Math.round(at(band, band.p05, time))}–${Math.round(at(band, band.p95, time))})`}
    >
      <select
        aria-label="Score"
        @change=${(event: Event) => {
          this.score = (event.target as HTMLSelectElement).value as Score;
        }}
      >
        <option value="rula">RULA score</option>
        <option value="reba">REBA score</option>
      </select>
    </ec-chart>`;
  }

  #band(candidate: Candidate): ScoreBand | null {
    return this.score === "rula" ? candidate.rula : candidate.reba;
  }

  #highChart(candidate: Candidate) {
    const chance = (item: Candidate | null) => {
      const rula = item?.rula;
      if (!rula) return undefined;
      return (rula.p_ge_5 ?? rula.pmf.map((pmf) => atLeast(pmf, 5))).map((p) => 100 * p);
    };
    const own = chance(candidate)!;
    const times = candidate.rula!.time_s;
    return html`<ec-chart
      label="Probability of RULA 5 or above"
      unit="%"
      .lines=${lines(times, own, this.compare?.rula?.time_s, chance(this.compare))}
      .zones=${PERCENT_ZONES}
      .limits=${[0, 105]}
      .ticks=${[0, 50, 100]}
      .playback=${this.playback}
      .reading=${(time: number) => percent(valueAt(times, own, time) / 100)}
    ></ec-chart>`;
  }

  #backChart(candidate: Candidate) {
    const back = candidate.back_angle_deg;
    if (!back) return nothing;
    const other = this.compare?.back_angle_deg;
    return html`<ec-chart
      label="Back angle, along the spine"
      unit="°"
      .lines=${lines(back.time_s, back.p50, other?.time_s, other?.p50)}
      .range=${{ label: "5–95 %", times: back.time_s, low: back.p05, high: back.p95 }}
      .playback=${this.playback}
      .reading=${(time: number) => `${at(back, back.p50, time).toFixed(0)}°`}
    ></ec-chart>`;
  }

  #effortChart(candidate: Candidate) {
    const efforts = candidate.effort_nm ?? {};
    const joints = Object.keys(efforts).sort(compareJoints);
    const joint = this.joint !== null && this.joint in efforts ? this.joint : joints[0];
    const times = candidate.rula!.time_s;
    const band: Band | undefined = joint === undefined ? undefined : efforts[joint];
    if (!band || joint === undefined) return nothing;
    const other = this.compare?.effort_nm?.[joint];
    return html`<ec-chart
      label="Effort"
      unit="N·m"
      timeAxis
      .lines=${lines(times, band.p50, other && this.compare?.rula?.time_s, other?.p50)}
      .range=${{ label: "5–95 %", times, low: band.p05, high: band.p95 }}
      .playback=${this.playback}
      .reading=${(time: number) => `${figure(valueAt(times, band.p50, time))} N·m`}
    >
      <select
        aria-label="Joint"
        .value=${joint}
        @change=${(event: Event) =>
          this.dispatchEvent(
            new CustomEvent("joint-select", {
              detail: (event.target as HTMLSelectElement).value,
              bubbles: true,
              composed: true,
            }),
          )}
      >
        ${joints.map(
          (name) =>
            html`<option value=${name} ?selected=${name === joint}>${jointWords(name)}</option>`,
        )}
      </select>
    </ec-chart>`;
  }
}

const at = (timed: { time_s: number[] }, values: number[], time: number) =>
  valueAt(timed.time_s, values, time);

/** The candidate's own curve over the one it is compared with. */
function lines(
  times: readonly number[],
  values: readonly number[],
  otherTimes?: readonly number[],
  otherValues?: readonly number[],
): Line[] {
  const all: Line[] = [];
  if (otherTimes && otherValues) {
    all.push({ label: "compared", times: otherTimes, values: otherValues, kind: "compare" });
  }
  all.push({ label: "expected", times, values, kind: "main" });
  return all;
}

declare global {
  interface HTMLElementTagNameMap {
    "ec-candidate-plots": EcCandidatePlots;
  }
}
