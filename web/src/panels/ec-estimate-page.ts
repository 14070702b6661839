import { LitElement, type PropertyValues, css, html, nothing } from "lit";
import { customElement, property, state } from "lit/decorators.js";

import { plottedColumns, postureColumns, postureOf, withGaps } from "../common/estimate-series";
import { balanceWords, facts, headline, stanceWords } from "../common/estimate-words";
import { figure, when } from "../common/format";
import { handleKey } from "../common/page-keys";
import { Playback } from "../common/playback";
import { sharedStyles } from "../common/shared-styles";
import "../components/ec-estimate-form";
import type { EstimateAsk, Progress } from "../components/ec-estimate-form";
import "../components/ec-holds";
import "../components/ec-peak-efforts";
import "../components/ec-player";
import "../components/ec-problem";
import {
  addRecording,
  addRecordingFile,
  createEstimate,
  getEstimate,
  getParquet,
  getSeries,
  getText,
  listEstimates,
  listRecordings,
  needsKey,
  parquetUrl,
} from "../data/api";
import type { EstimateItem, EstimateSummary, SeriesPart } from "../data/estimate-types";
import { asProblem } from "../data/problems";
import type { Posture, Problem, RecordingSummary } from "../data/types";
import "./ec-estimate-plots";
import { pageStyles } from "./page-styles";

/**
 * A recording with forces: drop its files, see what the body bore.
 *
 * @fires estimate-select `detail` is the id of the estimate to show, null for a new one.
 */
@customElement("ec-estimate-page")
export class EcEstimatePage extends LitElement {
  @property() estimateId: string | null = null;

  @state() private recordings: RecordingSummary[] = [];
  @state() private estimates: EstimateItem[] = [];
  @state() private estimate: EstimateSummary | null = null;
  @state() private columns: SeriesPart["columns"] = {};
  @state() private posture: Posture | null = null;
  @state() private urdf = "";
  @state() private joint: string | null = null;
  @state() private problem: Problem | null = null;
  @state() private progress: Progress | null = null;

  readonly playback = new Playback();
  #work: AbortController | null = null;
  #loading: AbortController | null = null;

  static override styles = [
    sharedStyles,
    pageStyles,
    css`
      .answer {
        display: flex;
        flex-wrap: wrap;
        gap: 0.5rem 1.5rem;
        align-items: start;
        justify-content: space-between;
      }
      .answer > div {
        flex: 1 1 34rem;
        min-width: 0;
      }
      .answer a {
        color: var(--accent);
      }
      .left {
        overflow-y: auto;
      }
      .left > * {
        flex: none;
      }
      .left section {
        padding: 0.6rem;
      }
      .left h2 {
        padding: 0 0.5rem 0.3rem;
      }
      .left ec-peak-efforts {
        padding: 0 0.5rem;
      }
      summary {
        padding: 0.7rem 0.9rem;
        cursor: pointer;
      }
      .more {
        grid-template-columns: minmax(0, 1fr) minmax(0, 1.3fr);
      }
      .more section {
        padding: 0.8rem 1rem;
      }
      .more > div {
        display: grid;
        gap: 0.9rem;
      }
      .more .wide {
        grid-column: 1 / -1;
      }
      .notes li {
        padding: 0.3rem 0;
        border-bottom: 1px solid var(--line);
        overflow-wrap: anywhere;
      }
      .notes li:last-child {
        border: none;
      }
      .start {
        max-width: 38rem;
        margin: 5vh auto 2rem;
        padding: 0 1rem;
        display: grid;
        gap: 0.9rem;
      }
      .start h1 {
        font-size: 1.5rem;
        letter-spacing: -0.015em;
      }
      .start label {
        display: grid;
        gap: 0.15rem;
      }
      @media (max-width: 760px) {
        .more {
          grid-template-columns: minmax(0, 1fr);
        }
        .left {
          overflow-y: visible;
        }
        .plots {
          height: 46rem;
        }
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
    this.#loading?.abort();
  }

  override updated(changed: PropertyValues<this>): void {
    if (changed.has("estimateId")) void this.#load(this.estimateId);
  }

  override render() {
    const estimate = this.estimate;
    if (this.estimateId === null || (!estimate && this.problem)) return this.#start();
    if (!estimate) return html`<main><p class="card empty soft">Loading…</p></main>`;
    return html`<main>
      <section class="answer">
        <div>
          <h1>${headline(estimate)}</h1>
          <p>${facts(estimate).join(" ")}</p>
        </div>
        <a href=${parquetUrl(estimate.id)} download @click=${this.#onDownload}
          >Download all columns (Parquet)</a
        >
      </section>
      <div class="left">
        <details class="card">
          <summary><b>Another recording or setting…</b></summary>
          ${this.#form()}
        </details>
        <section class="card" aria-label="Payload by hold">
          <h2>Payload by hold</h2>
          <ec-holds .holds=${estimate.holds} .playback=${this.playback}></ec-holds>
        </section>
        <section class="card" aria-label="Greatest efforts">
          <h2>Greatest efforts, N·m</h2>
          <ec-peak-efforts
            .efforts=${estimate.efforts}
            .playback=${this.playback}
            @joint-select=${this.#onJoint}
          ></ec-peak-efforts>
        </section>
      </div>
      <div class="body">
        <ec-player
          class="card grow"
          .urdf=${this.urdf}
          .posture=${this.posture}
          .playback=${this.playback}
          .joint=${this.joint}
          ?busy=${this.posture === null && this.problem === null}
          @joint-select=${this.#onJoint}
        ></ec-player>
      </div>
      <div class="plots">
        <ec-estimate-plots
          class="card grow"
          .estimate=${estimate}
          .columns=${this.columns}
          .playback=${this.playback}
        ></ec-estimate-plots>
      </div>
      <div class="more">
        ${this.problem ? html`<ec-problem class="wide" .problem=${this.problem}></ec-problem>` : nothing}
        <section class="card wide" aria-label="Joint efforts">
          <h2>Greatest joint efforts over time</h2>
          <ec-estimate-plots
            joints
            .estimate=${estimate}
            .columns=${this.columns}
            .playback=${this.playback}
          ></ec-estimate-plots>
        </section>
        <div>
          ${notes("Found", estimate.findings, "Nothing that does not fit.")}
          ${notes("Low back, feet and plates", loads(estimate), "Nothing is known of them.")}
        </div>
        ${notes("Assumed, not measured", estimate.assumed, "Nothing: all was given or measured.")}
      </div>
    </main>`;
  }

  #start() {
    return html`<section class="start">
      <h1>What did the body bear?</h1>
      <p class="soft">
        A motion with the forces under the feet: the payload that nobody weighed, the effort of
        every joint, and how sure each is. Markers (C3D, TRC, CSV, .mat) go with a static trial;
        without forces, spine and arms alone are told.
      </p>
      ${
        this.estimates.length > 0
          ? html`<label class="small soft"
              >Estimated before
              <select
                @change=${(event: Event) => this.#select((event.target as HTMLSelectElement).value)}
              >
                <option value="">–</option>
                ${this.estimates.map(
                  (item) =>
                    html`<option value=${item.id}>${item.source}, ${when(item.created)}</option>`,
                )}
              </select></label
            >`
          : nothing
      }
      <div class="card">${this.#form()}</div>
    </section>`;
  }

  #form() {
    return html`<ec-estimate-form
      .recordings=${this.recordings}
      .previous=${this.estimate}
      .progress=${this.progress}
      .problem=${this.problem}
      @estimate-ask=${(event: CustomEvent<EstimateAsk>) => this.#ask(event.detail)}
      @estimate-cancel=${() => {
        this.#work?.abort();
        this.progress = { fraction: null, message: "Stopping…" };
      }}
    ></ec-estimate-form>`;
  }

  #select(id: string | null): void {
    this.dispatchEvent(new CustomEvent("estimate-select", { detail: id }));
  }

  async #list(): Promise<void> {
    try {
      const [recordings, estimates] = await Promise.all([listRecordings(), listEstimates()]);
      this.recordings = recordings.items;
      this.estimates = estimates.items;
    } catch (cause) {
      this.problem = asProblem(cause);
    }
  }

  async #ask({ motion, files, options }: EstimateAsk): Promise<void> {
    this.problem = null;
    this.#work = new AbortController();
    const { signal } = this.#work;
    const tell = (message: string, fraction: number | null = null) => {
      if (!signal.aborted) this.progress = { fraction, message };
    };
    try {
      let recording = motion instanceof File ? null : motion;
      if (motion instanceof File) {
        tell(`Sending ${motion.name}…`);
        recording = await addRecording(motion);
      }
      for (const { role, file } of files) {
        if (signal.aborted) return;
        tell(`Sending ${file.name}…`);
        await addRecordingFile(recording!.id, role, file);
      }
      if (signal.aborted) return;
      tell("Asking…");
      const found = await createEstimate(
        { recording_id: recording!.id, ...options },
        (fraction, message) => tell(`${message || "Estimating"}…`, fraction),
        signal,
      );
      // Done before it could be stopped: it stands in the list, but was no longer wanted here.
      if (signal.aborted) return;
      if (found.id === this.estimateId) await this.#load(found.id);
      else this.#select(found.id);
    } catch (cause) {
      // What was stopped on purpose is no problem.
      if (!signal.aborted) this.problem = asProblem(cause);
    } finally {
      this.progress = null;
      void this.#list();
    }
  }

  async #load(id: string | null): Promise<void> {
    this.#loading?.abort();
    this.#loading = new AbortController();
    const { signal } = this.#loading;
    this.estimate = null;
    this.posture = null;
    this.columns = {};
    this.problem = null;
    this.playback.pause();
    if (id === null) return;
    try {
      const estimate = await getEstimate(id, signal);
      const columns = withGaps((await getSeries(id, plottedColumns(estimate), signal)).columns);
      if (signal.aborted) return;
      const times = (columns["time_s"] ?? []) as number[];
      const peak = estimate.efforts[0];
      this.playback.load(times[0] ?? 0, times[times.length - 1] ?? 0);
      const carried = estimate.holds.some((hold) => hold.state === "loaded");
      const most = carried ? estimate.payload.max_kg : peak;
      this.playback.seek(most?.at_s ?? 0);
      this.columns = columns;
      this.estimate = estimate;
      this.joint = peak?.joint ?? null;
      // The body is many columns more: the figures do not wait for it.
      const [urdf, body] = await Promise.all([
        getText(estimate.model_urdf_url),
        getSeries(id, postureColumns(estimate), signal),
      ]);
      if (signal.aborted) return;
      this.urdf = urdf;
      this.posture = postureOf(body.columns, peak?.peak_nm.p50 ?? 0);
    } catch (cause) {
      if (!signal.aborted) this.problem = asProblem(cause);
    }
  }

  #onJoint = (event: CustomEvent<string>): void => {
    this.joint = event.detail;
  };

  /** A link cannot carry the key of a service that asks for one: the file is fetched instead. */
  #onDownload = async (event: Event): Promise<void> => {
    if (!needsKey() || !this.estimate) return;
    event.preventDefault();
    try {
      const link = document.createElement("a");
      link.href = URL.createObjectURL(await getParquet(this.estimate.id));
      link.download = `${this.estimate.source}.parquet`;
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
    } catch (cause) {
      this.problem = asProblem(cause);
    }
  };

  #onKey = (event: KeyboardEvent): void => {
    if (this.estimate) handleKey(event, this.playback);
  };
}

/** Texts of the service, each whole. */
function notes(title: string, texts: readonly string[], none: string) {
  return html`<section class="card" aria-label=${title}>
    <h2>${title}</h2>
    ${
      texts.length === 0
        ? html`<p class="soft">${none}</p>`
        : html`<ul class="notes">
            ${texts.map((text) => html`<li>${text}</li>`)}
          </ul>`
    }
  </section>`;
}

/** The low back's greatest force and moment, how the feet stood on the plates, and their clock. */
function loads(estimate: EstimateSummary): string[] {
  const { low_back: back, feet, files } = estimate;
  const sized = (value: number, sd: number | null, unit: string) =>
    `${figure(value)}${sd === null ? "" : ` ± ${figure(sd)}`} ${unit}`;
  return [
    back
      ? `Low back (L5–S1), most: ${sized(back.peak_force_n, back.peak_force_sd_n, "N")} at ` +
        `${back.peak_force_at_s.toFixed(2)} s, ` +
        `${sized(back.peak_moment_nm, back.peak_moment_sd_nm, "N·m")} at ` +
        `${back.peak_moment_at_s.toFixed(2)} s (± one standard deviation)`
      : "The low back’s load cannot be told.",
    balanceWords(estimate),
    ...stanceWords(estimate),
    ...(feet?.clock ? [`Clocks: ${feet.clock.from}`] : []),
    `Files: ${files.map((one) => `${one.role} ${one.name}`).join(", ")}`,
  ];
}

declare global {
  interface HTMLElementTagNameMap {
    "ec-estimate-page": EcEstimatePage;
  }
}
