// Small helpers for the page's elements.

type Child = Node | string;
type Props = Record<string, string | boolean | number | ((event: Event) => void)>;

/** An element with attributes, listeners (functions) and children. */
export function make<K extends keyof HTMLElementTagNameMap>(tag: K, props: Props = {}, ...children: Child[]): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(props)) {
    if (typeof value === "function") element.addEventListener(name, value);
    else if (value === true) element.setAttribute(name, "");
    else if (value !== false) element.setAttribute(name, String(value));
  }
  element.append(...children);
  return element;
}

export function byId<T extends HTMLElement = HTMLElement>(id: string): T {
  const element = document.getElementById(id);
  if (!element) throw new Error(`no element ${id}`);
  return element as T;
}

/** A number with so many digits, for reading. */
export function pretty(value: number, digits = 6): string {
  if (!Number.isFinite(value)) return "—";
  const size = Math.abs(value);
  const text = size !== 0 && (size < 1e-4 || size >= 1e6) ? value.toExponential(digits - 1) : String(Number(value.toPrecision(digits)));
  return text.replace("-", "−");
}

/** Text with subscripts: "x_r" becomes x with a small r. */
export function symbol(text: string): HTMLElement {
  const [base = "", index] = text.split("_");
  const element = make("i", { class: "symbol" }, base);
  if (index) element.append(make("sub", {}, index));
  return element;
}

/** A local or global map with planes and fields as subscripts. */
export function mapText(text: string): Node {
  const fragment = document.createDocumentFragment();
  for (const piece of text.split(/(\w+_\{[^}]*\}| ∘ )/)) {
    const found = /^(\w+)_\{([^}]*)\}$/.exec(piece);
    if (found) fragment.append(make("span", { class: "local" }, make("i", {}, found[1] ?? ""), make("sub", {}, found[2] ?? "")));
    else if (piece) fragment.append(piece);
  }
  return fragment;
}

export function download(name: string, content: string | Blob, type = "text/plain"): void {
  const url = URL.createObjectURL(content instanceof Blob ? content : new Blob([content], { type }));
  const link = make("a", { href: url, download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}
