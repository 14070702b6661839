import { LitElement, css, html } from "lit";
import { customElement, property, query, state } from "lit/decorators.js";

import { sharedStyles } from "../common/shared-styles";

/**
 * A place to drop a file on, or to choose one by click or keyboard.
 *
 * @fires file-chosen `detail` is the `File`.
 */
@customElement("ec-file-drop")
export class EcFileDrop extends LitElement {
  @property() label = "Drop a file here, or choose one";
  /** Endings the chooser offers first, as for `<input accept>`. */
  @property() accept = "";
  @property({ type: Boolean }) disabled = false;

  @state() private over = false;
  @query("input") private input!: HTMLInputElement;

  static override styles = [
    sharedStyles,
    css`
      :host {
        display: block;
      }
      button {
        width: 100%;
        padding: 1.2rem 1rem;
        border: 1.5px dashed var(--line);
        border-radius: var(--radius);
        background: var(--sunken);
        color: var(--ink-soft);
      }
      button.over {
        border-color: var(--accent);
        background: var(--accent-soft);
        color: var(--ink);
      }
    `,
  ];

  override render() {
    return html`
      <button
        class=${this.over ? "over" : ""}
        ?disabled=${this.disabled}
        @click=${() => this.input.click()}
        @dragover=${(event: DragEvent) => {
          event.preventDefault();
          this.over = true;
        }}
        @dragleave=${() => {
          this.over = false;
        }}
        @drop=${this.#onDrop}
      >
        ${this.label}
      </button>
      <input
        type="file"
        hidden
        aria-label=${this.label}
        accept=${this.accept}
        @change=${() => {
          this.#choose(this.input.files?.[0]);
          this.input.value = "";
        }}
      />
    `;
  }

  #onDrop(event: DragEvent): void {
    event.preventDefault();
    this.over = false;
    if (!this.disabled) this.#choose(event.dataTransfer?.files[0]);
  }

  #choose(file: File | undefined): void {
    if (!file) return;
    this.dispatchEvent(new CustomEvent("file-chosen", { detail: file }));
  }
}

declare global {
  interface HTMLElementTagNameMap {
    "ec-file-drop": EcFileDrop;
  }
}
