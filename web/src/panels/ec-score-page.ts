import { LitElement, css, html, nothing } from "lit";
import { customElement, query, state } from "lit/decorators.js";

import { percent, seconds } from "../common/format";
import { inspectionWords } from "../common/inspection-words";
import { distinctMoments } from "../common/moment-words";
import { handleKey } from "../common/page-keys";
import { Playback } from "../common/playback";
import {
  REBA_LIMITS,
  REBA_TICKS,
  REBA_ZONES,
  RULA_LIMITS,
  RULA_TICKS,
  RULA_ZONES,
} from "../common/score-zones";
import { sharedStyles } from "../common/shared-styles";
import { nearestValue, valueAt } from "../common/time-lookup";
import type { Line } from "../components/chart-series";
import "../components/ec-assumed";
import "../components/ec-chart";
import "../components/ec-file-drop";
import "../components/ec-moments";
import "../components/ec-player";
import "../components/ec-problem";
import { addRecording, createScore, getText, listRecordings } from "../data/api";
import { asProblem } from "../data/problems";
import type { Problem, RecordingSummary, ScoreRequest, ScoreResult } from "../data/types";
import { pageStyles } from "./page-styles";

/** Fields of the person and the load; an empty one is left for the service to assume and to say so. */
const FIELDS = [
  { key: "height_m", label: "Height", unit: "m", step: "0.01", least: "0.5", most: "2.5" },
  { key: "mass_kg", label: "Mass", unit: "kg", step: "0.5", least: "10", most: "300" },
  {
    key: "hand_load_kg",
    label: "Load in both hands",
    unit: "kg",
    step: "0.1",
    least: "0",
    most: "100",
  },
] as const;

/** A recording scored: drop a file, see the worst moments on the body. */
@customElement("ec-score-page")
export class EcScorePage extends LitElement {
  @state() private recordings: RecordingSummary[] = [];
  @state() private recording: RecordingSummary | null = null;
  @state() private result: ScoreResult | null = null;
  @state() private urdf = "";
  @state() private problem: Problem | null = null;
  @state() private progress = "";
  @query("form") private form!: HTMLFormElement;

  readonly playback = new Playback();

  static override styles = [
    sharedStyles,
    pageStyles,
    css`
      form {
        padding: 0.9rem;
        display: grid;
        gap: 0.8rem;
      }
      .fields {
        display: grid;
        grid-template-columns: 1fr 1fr;
        gap: 0.6rem;
      }
      label {
        display: grid;
        gap: 0.15rem;
        font-size: 0.86rem;
        color: var(--ink-soft);
      }
      label input,
      label select {
        width: 100%;
        color: var(--ink);
      }
      .notes li {
        padding: 0.3rem 0;
        border-bottom: 1px solid var(--line);
        overflow-wrap: anywhere;
      }
      .notes li:last-child {
        border: none;
      }
      .summary {
        padding: 0.7rem 0.9rem;
      }
      .left .moments {
        flex: 1;
        max-height: none;
        min-height: 8rem;
      }
      table {
        width: 100%;
        border-collapse: collapse;
      }
      th {
        font-weight: 560;
        font-size: 0.79rem;
        color: var(--ink-soft);
        text-align: right;
      }
      td {
        text-align: right;
        padding: 0.12rem 0;
      }
      td:first-child,
      th:first-child {
        text-align: left;
      }
      .start {
        max-width: 34rem;
        margin: 9vh auto;
        padding: 0 1rem;
        display: grid;
        gap: 0.9rem;
      }
      .start h1 {
        font-size: 1.5rem;
        letter-spacing: -0.015em;
      }
    `,
  ];

  override connectedCallback(): void {
    super.connectedCallback();
    window.addEventListener("keydown", this.#onKey);
    void this.#list();
  }

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    window.removeEventListener("keydown", this.#onKey);
    this.playback.pause();
  }

  override render() {
    const result = this.result;
    if (!result) {
      return html`<section class="start">
        <h1>Score a recording</h1>
        <p class="soft">
          Drop a motion recording (Xsens MVNX or BVH): its RULA and REBA over time, and the worst
          moments on the body.
        </p>
        <div class="card">${this.#form()}</div>
      </section>`;
    }
    const read = inspectionWords(this.recording?.inspection ?? {});
    return html`<main>
      <section class="answer">
        <h1>${headline(result)}</h1>
        <p>
          ${[this.recording?.name ?? result.recording_id, read.facts].filter(Boolean).join(": ")}
        </p>
      </section>
      <div class="left">
        <details class="card">
          <summary class="summary"><b>Another recording or load…</b></summary>
          ${this.#form()}
        </details>
        <section class="card summary">${summaryTable(result)}</section>
        <section class="card moments" aria-label="Worst moments">
          <h2>Worst moments</h2>
          <ec-moments
            .moments=${distinctMoments(result.worst)}
            .playback=${this.playback}
          ></ec-moments>
        </section>
      </div>
      <div class="body">
        <ec-player
          class="card grow"
          .urdf=${this.urdf}
          .posture=${result.posture}
          .playback=${this.playback}
        ></ec-player>
      </div>
      <div class="plots"><div class="card grow stack">${this.#plots(result)}</div></div>
      <div class="more">
        <section class="card">
          <h2>Assumed, not measured</h2>
          <ec-assumed .assumed=${result.assumed}></ec-assumed>
        </section>
        ${
          read.notes.length > 0
            ? html`<section class="card">
                <h2>What was read</h2>
                <ul class="notes">
                  ${read.notes.map((note) => html`<li>${note}</li>`)}
                </ul>
              </section>`
            : nothing
        }
      </div>
    </main>`;
  }

  #form() {
    const busy = this.progress !== "";
    return html`<form
      @submit=${(event: Event) => {
        event.preventDefault();
        if (this.recording) void this.#score(this.recording);
      }}
    >
      <ec-file-drop
        label=${this.recording ? `${this.recording.name}: drop another to replace` : "Drop a recording here, or choose one"}
        accept=".mvnx,.bvh"
        ?disabled=${busy}
        @file-chosen=${this.#onFile}
      ></ec-file-drop>
      ${
        this.recordings.length > 0
          ? html`<label
              >Or one sent before
              <select
                @change=${(event: Event) => {
                  const id = (event.target as HTMLSelectElement).value;
                  this.recording = this.recordings.find((item) => item.id === id) ?? null;
                }}
              >
                <option value="">–</option>
                ${this.recordings.map(
                  (item) =>
                    html`<option value=${item.id} ?selected=${item.id === this.recording?.id}>
                      ${item.name}
                    </option>`,
                )}
              </select></label
            >`
          : nothing
      }
      <div class="fields">
        ${FIELDS.map(
          (field) =>
            html`<label
              >${field.label}, ${field.unit}
              <input
                type="number"
                name=${field.key}
                step=${field.step}
                min=${field.least}
                max=${field.most}
                placeholder="not given"
            /></label>`,
        )}
        <label
          >Sex
          <select name="sex">
            <option value="">not given</option>
            <option value="female">female</option>
            <option value="male">male</option>
          </select></label
        >
      </div>
      ${this.problem ? html`<ec-problem .problem=${this.problem}></ec-problem>` : nothing}
      <button class="primary" ?disabled=${busy || !this.recording}>
        ${busy ? this.progress : "Score"}
      </button>
    </form>`;
  }

  #plots(result: ScoreResult) {
    const times = result.time_s;
    const line = (score: "rula" | "reba"): Line[] => [
      { label: "worse side", times, values: result[score], kind: "main", stepped: true },
    ];
    const reading = (score: "rula" | "reba") => (time: number) =>
      `${nearestValue(times, result[score], time)}  (left ${nearestValue(times, result.sides.left[score], time)}, right ${nearestValue(times, result.sides.right[score], time)})`;
    const marks = distinctMoments(result.worst).map((moment) => moment.time_s);
    return html`
      <ec-chart
        label="RULA, worse side"
        class="tall"
        .lines=${line("rula")}
        .zones=${RULA_ZONES}
        .limits=${RULA_LIMITS}
        .ticks=${RULA_TICKS}
        .marks=${marks}
        .playback=${this.playback}
        .reading=${reading("rula")}
      ></ec-chart>
      <ec-chart
        label="REBA, worse side"
        class="tall"
        .lines=${line("reba")}
        .zones=${REBA_ZONES}
        .limits=${REBA_LIMITS}
        .ticks=${REBA_TICKS}
        .playback=${this.playback}
        .reading=${reading("reba")}
      ></ec-chart>
      <ec-chart
        label="Back angle, along the spine"
        unit="°"
        timeAxis
        .lines=${[{ label: "back", times, values: result.back_angle_deg, kind: "main" }]}
        .playback=${this.playback}
        .reading=${(time: number) => `${valueAt(times, result.back_angle_deg, time).toFixed(0)}°`}
      ></ec-chart>
    `;
  }

  async #list(): Promise<void> {
    try {
      this.recordings = (await listRecordings()).items;
    } catch (cause) {
      this.problem = asProblem(cause);
    }
  }

  async #onFile(event: CustomEvent<File>): Promise<void> {
    this.problem = null;
    this.progress = "Reading the recording…";
    try {
      this.recording = await addRecording(event.detail);
      await this.#list();
    } catch (cause) {
      this.problem = asProblem(cause);
      this.progress = "";
      return;
    }
    await this.#score(this.recording);
  }

  async #score(recording: RecordingSummary): Promise<void> {
    this.problem = null;
    this.progress = "Scoring…";
    const body: ScoreRequest = { recording_id: recording.id };
    const given = new FormData(this.form);
    for (const { key } of FIELDS) {
      const text = given.get(key);
      if (typeof text === "string" && text.trim() !== "") body[key] = Number(text);
    }
    const sex = given.get("sex");
    if (typeof sex === "string" && sex !== "") body.sex = sex;
    try {
      const result = await createScore(body, (_, message) => {
        this.progress = message;
      });
      this.urdf = await getText(result.model_urdf_url);
      this.result = result;
      this.playback.load(result.time_s[0] ?? 0, result.time_s[result.time_s.length - 1] ?? 0);
      this.playback.seek(result.summary.rula.time_of_max_s);
    } catch (cause) {
      this.problem = asProblem(cause);
    } finally {
      this.progress = "";
    }
  }

  #onKey = (event: KeyboardEvent): void => {
    if (this.result) handleKey(event, this.playback);
  };
}

/** The score in a sentence: how long it is bad, and when it is worst. */
export function headline(result: ScoreResult): string {
  const { rula } = result.summary;
  const times = result.time_s;
  const duration = (times[times.length - 1] ?? 0) - (times[0] ?? 0);
  const bad = rula.time_at_or_above["5"] ?? 0;
  const share = duration > 0 ? ` (${percent(bad / duration)})` : "";
  const worst = `worst ${rula.max} at ${seconds(rula.time_of_max_s, 1)}`;
  if (bad <= 0) return `RULA never reaches 5: ${worst}`;
  return `RULA is 5 or above for ${seconds(bad, 1)} of ${seconds(duration, 1)}${share}: ${worst}`;
}

function summaryTable(result: ScoreResult) {
  const { rula, reba } = result.summary;
  const levels = (score: Record<string, number>) =>
    Object.entries(score).map(
      ([level, time]) =>
        html`<tr>
          <td>at ${level} or above</td>
          <td colspan="2">${seconds(time, 1)}</td>
        </tr>`,
    );
  return html`<table class="number small">
    <tr>
      <th></th>
      <th>RULA</th>
      <th>REBA</th>
    </tr>
    <tr>
      <td>median</td>
      <td>${rula.median}</td>
      <td>${reba.median}</td>
    </tr>
    <tr>
      <td>90th percentile</td>
      <td>${rula.p90}</td>
      <td>${reba.p90}</td>
    </tr>
    <tr>
      <td>largest</td>
      <td>${rula.max}</td>
      <td>${reba.max}</td>
    </tr>
    <tr>
      <th>RULA, time</th>
      <th></th>
      <th></th>
    </tr>
    ${levels(rula.time_at_or_above)}
  </table>`;
}

declare global {
  interface HTMLElementTagNameMap {
    "ec-score-page": EcScorePage;
  }
}
