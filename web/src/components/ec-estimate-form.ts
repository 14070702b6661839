import { LitElement, css, html, nothing } from "lit";
import { customElement, property, query, state } from "lit/decorators.js";

import { estimateOptions } from "../common/estimate-request";
import { sharedStyles } from "../common/shared-styles";
import type { EstimateOptions, EstimateSummary } from "../data/estimate-types";
import type { Problem, RecordingSummary } from "../data/types";
import "./ec-file-drop";
import "./ec-problem";

/** What is asked: a new file or a recording sent before, what goes with it, and the settings. */
export interface EstimateAsk {
  motion: File | RecordingSummary;
  files: { role: string; file: File }[];
  options: EstimateOptions;
}

/** How far the work is; a fraction only where it is known. */
export interface Progress {
  fraction: number | null;
  message: string;
}

const MARKERS = ".c3d,.trc,.csv,.mat";
const MOTION = `${MARKERS},.mvnx,.bvh`;
const FORCES = ".mot,.sto,.c3d";
const COMMON = [
  { role: "static", label: "Static trial", accept: MARKERS },
  { role: "grf", label: "Force plates", accept: FORCES },
];
const RARE = [
  { role: "static_grf", label: "Plates of the static trial", accept: FORCES },
  { role: "marker_set", label: "Marker set (JSON)", accept: ".json" },
  { role: "columns", label: "Columns of CSV or .mat (JSON)", accept: ".json" },
];

/**
 * Asks for the files by what they are, the person, and how to estimate.
 *
 * @fires estimate-ask `detail` is an `EstimateAsk`.
 * @fires estimate-cancel The work that `progress` tells of is no longer wanted.
 */
@customElement("ec-estimate-form")
export class EcEstimateForm extends LitElement {
  @property({ attribute: false }) recordings: RecordingSummary[] = [];
  /** The estimate on the page: its settings stand in the fields. */
  @property({ attribute: false }) previous: EstimateSummary | null = null;
  @property({ attribute: false }) progress: Progress | null = null;
  @property({ attribute: false }) problem: Problem | null = null;

  @state() private motion: File | null = null;
  @state() private chosen: string | null = null;
  @state() private files: Readonly<Record<string, File>> = {};
  @state() private fault: Problem | null = null;
  @query("form") private form!: HTMLFormElement;

  static override styles = [
    sharedStyles,
    css`
      form {
        padding: 0.9rem;
        display: grid;
        gap: 0.8rem;
      }
      .fields {
        display: grid;
        grid-template-columns: repeat(2, minmax(0, 1fr));
        gap: 0.6rem;
        align-items: end;
      }
      label,
      .file {
        display: grid;
        gap: 0.15rem;
        font-size: 0.86rem;
        color: var(--ink-soft);
        min-width: 0;
        overflow-wrap: anywhere;
      }
      .file {
        align-self: start;
      }
      .file button {
        justify-self: end;
        min-height: 0;
        border: none;
        background: none;
        padding: 0.1rem 0.3rem;
        text-decoration: underline;
      }
      label input,
      label select {
        width: 100%;
        color: var(--ink);
      }
      .two {
        display: grid;
        grid-template-columns: 1fr 1fr;
        gap: 0.4rem;
      }
      details > div {
        /* What browsers put between would hand down another one. */
        box-sizing: border-box;
        margin-top: 0.6rem;
      }
      .work {
        display: grid;
        grid-template-columns: 1fr auto;
        gap: 0.4rem 0.8rem;
        align-items: center;
      }
      progress {
        width: 100%;
        accent-color: var(--accent);
      }
      .work span {
        grid-column: 1 / -1;
      }
    `,
  ];

  override render() {
    const busy = this.progress !== null;
    const recording = this.#recording();
    const problem = this.fault ?? this.problem;
    return html`<form
      novalidate
      @submit=${(event: Event) => {
        event.preventDefault();
        this.#ask();
      }}
    >
      ${this.#drop("motion", "Motion", MOTION, this.motion?.name ?? recording?.name ?? null, true)}
      ${
        this.recordings.length > 0
          ? html`<label
              >Or one sent before
              <select
                @change=${(event: Event) => {
                  this.chosen = (event.target as HTMLSelectElement).value;
                  this.motion = null;
                }}
              >
                <option value="">–</option>
                ${this.recordings.map(
                  (item) =>
                    html`<option value=${item.id} ?selected=${item.id === recording?.id}>
                      ${item.name}
                    </option>`,
                )}
              </select></label
            >`
          : nothing
      }
      ${
        recording?.files?.length
          ? html`<p class="small soft">
              Sent with it before:
              ${recording.files.map((one) => `${one.role} ${one.name}`).join(", ")}
            </p>`
          : nothing
      }
      <div class="fields">
        ${COMMON.map((one) => this.#drop(one.role, one.label, one.accept, null))}
      </div>
      <div class="fields">
        ${this.#number("height_m", "Height, m", "0.01", "needed")}
        ${this.#number("mass_kg", "Mass, kg", "0.1", "from the static trial")}
        ${this.#choice("sex", "Sex", { unknown: "not given", female: "female", male: "male" })}
        ${this.#choice("hands", "Hands that may bear", {
          auto: "both, if there are forces",
          both: "both",
          right: "right",
          left: "left",
          none: "none",
        })}
      </div>
      <label title="Body mass is set so that the plates balance there"
        >Stands still with empty hands (tare), from and to, s
        <span class="two">
          <input
            type="number"
            step="any"
            name="tare_from"
            aria-label="Tare from, s"
            placeholder="no tare"
            .value=${this.#before("tare_s", 0)}
          />
          <input
            type="number"
            step="any"
            name="tare_to"
            aria-label="Tare to, s"
            placeholder="no tare"
            .value=${this.#before("tare_s", 1)}
          /> </span
      ></label>
      <details>
        <summary class="small">Other files and settings</summary>
        <div class="fields">
          ${RARE.map((one) => this.#drop(one.role, one.label, one.accept, null))}
          ${this.#number("clock_offset_s", "Added to the plates’ times, s", "any", "estimated")}
          ${this.#choice("definition", "Kilograms over time", {
            inertial: "inertial",
            vertical: "vertical",
            norm: "norm",
          })}
          ${this.#choice("bands", "Bands hold", {
            noise_and_model: "noise and errors of the body model",
            noise: "the sensors’ noise alone",
          })}
          <label
            >Go on in spite of (codes)
            <input type="text" name="accept" placeholder="none" .value=${this.#before("accept")}
          /></label>
        </div>
      </details>
      ${problem ? html`<ec-problem .problem=${problem}></ec-problem>` : nothing}
      ${busy ? this.#working(this.progress!) : html`<button class="primary">Estimate</button>`}
    </form>`;
  }

  #working({ fraction, message }: Progress) {
    return html`<div class="work">
      <span class="small" role="status">${message}</span>
      ${
        fraction === null
          ? html`<progress aria-label="Progress"></progress>`
          : html`<progress aria-label="Progress" max="1" .value=${fraction}></progress>`
      }
      <button type="button" @click=${() => this.dispatchEvent(new CustomEvent("estimate-cancel"))}>
        Cancel
      </button>
    </div>`;
  }

  #drop(role: string, label: string, accept: string, name: string | null, motion = false) {
    const file = motion ? this.motion : this.files[role];
    const shown = file?.name ?? name;
    const hint = motion ? "drop a recording here, or choose one" : "drop or choose";
    return html`<div class="file" data-role=${role}>
      <ec-file-drop
        label=${shown ? `${label}: ${shown}` : `${label}: ${hint}`}
        accept=${accept}
        ?disabled=${this.progress !== null}
        @file-chosen=${(event: CustomEvent<File>) => {
          if (motion) {
            this.motion = event.detail;
            this.chosen = "";
          } else this.files = { ...this.files, [role]: event.detail };
        }}
      ></ec-file-drop>
      ${
        file && !motion
          ? html`<button
              type="button"
              aria-label="Remove ${file.name}"
              @click=${() => {
                this.files = Object.fromEntries(
                  Object.entries(this.files).filter(([key]) => key !== role),
                );
              }}
            >
              Remove
            </button>`
          : nothing
      }
    </div>`;
  }

  #number(name: string, label: string, step: string, placeholder: string) {
    return html`<label
      >${label}
      <input
        type="number"
        step=${step}
        name=${name}
        placeholder=${placeholder}
        .value=${this.#before(name)}
    /></label>`;
  }

  #choice(name: string, label: string, options: Readonly<Record<string, string>>) {
    const before = this.#before(name);
    return html`<label
      >${label}
      <select name=${name}>
        ${Object.entries(options).map(
          ([value, text]) =>
            html`<option value=${value} ?selected=${value === before}>${text}</option>`,
        )}
      </select></label
    >`;
  }

  /** A setting of the estimate on the page, as its field shows it. */
  #before(name: string, index?: number): string {
    const value = this.previous?.options[name];
    if (value === null || value === undefined) return "";
    if (!Array.isArray(value)) return String(value);
    return index === undefined ? value.join(", ") : String(value[index]);
  }

  #recording(): RecordingSummary | null {
    const id = this.chosen ?? this.previous?.recording_id;
    return this.recordings.find((item) => item.id === id) ?? null;
  }

  #ask(): void {
    const motion = this.motion ?? this.#recording();
    const read = estimateOptions(new FormData(this.form));
    const faults = "faults" in read ? read.faults : [];
    if (!motion) faults.unshift({ detail: "There is no motion yet: drop or choose a recording." });
    this.fault =
      faults.length > 0
        ? { type: "about:blank", title: "Not yet", status: 0, errors: faults }
        : null;
    if (!motion || "faults" in read) return;
    const files = Object.entries(this.files).map(([role, file]) => ({ role, file }));
    const detail: EstimateAsk = { motion, files, options: read.options };
    this.dispatchEvent(new CustomEvent("estimate-ask", { detail }));
  }
}

declare global {
  interface HTMLElementTagNameMap {
    "ec-estimate-form": EcEstimateForm;
  }
}
