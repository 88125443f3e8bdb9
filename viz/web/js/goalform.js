// A form for a goal: fields as the server describes them (viz/live/forms.py), values as a tree of
// texts, and the YAML that the server reads. It alone judges values; the form shows what it says.
import { h } from "preact";
import htm from "htm";

const html = htm.bind(h);
const NUMBER = /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$/i;
const SPECIAL = { nan: ".nan", ".nan": ".nan", inf: ".inf", "+inf": ".inf", ".inf": ".inf", infinity: ".inf", "-inf": "-.inf", "-.inf": "-.inf", "-infinity": "-.inf" };
const UNPRINTABLE = /[\u007f-\u009f\u2028\u2029\ufeff\ufffe\uffff]/g;
const MOST_ROWS = 200;

// -- values ---------------------------------------------------------------------------------------

// Arrays of these are one text, separated by commas.
const inOneText = (field) => field.array && !["string", "message"].includes(field.kind);

export function toState(fields, values) {
  const state = {};
  for (const field of fields) state[field.name] = stateOf(field, values[field.name]);
  return state;
}
function stateOf(field, value) {
  if (inOneText(field)) return value.join(", ");
  if (field.array) return value.map((item) => (field.kind === "message" ? toState(field.fields, item) : item));
  return field.kind === "message" ? toState(field.fields, value) : value;
}

export function toYaml(fields, state) {
  return `{${fields.map((f) => `${f.name}: ${yamlOf(f, state[f.name])}`).join(", ")}}`;
}
function yamlOf(field, value) {
  if (inOneText(field)) return `[${split(value).map((text) => scalar(field.kind, text)).join(", ")}]`;
  const one = (item) => (field.kind === "message" ? toYaml(field.fields, item) : scalar(field.kind, item));
  return field.array ? `[${value.map(one).join(", ")}]` : one(value);
}
const split = (text) => {
  const inner = text.trim().replace(/^\[|\]$/g, "").trim();
  return inner ? inner.split(/\s*,\s*|\s+/) : [];
};
function scalar(kind, value) {
  if (kind === "string") return quoted(value);
  if (kind === "bool") return typeof value === "boolean" ? String(value) : ["true", "false"].includes(value) ? value : quoted(value);
  const text = String(value).trim();
  if (kind === "time") return text === "now" ? "now" : NUMBER.test(text) ? time(text) : quoted(text);
  if (kind === "integer" && /^[-+]?\d+$/.test(text)) return BigInt(text.replace("+", "")).toString();
  if (kind === "float" && text.toLowerCase() in SPECIAL) return SPECIAL[text.toLowerCase()];
  return NUMBER.test(text) && Number.isFinite(Number(text)) ? decimal(text) : quoted(text);
}
const decimal = (text) => { // what YAML takes for a float: with a point
  const short = String(Number(text));
  return /[.]/.test(short) ? short : short.includes("e") ? short.replace("e", ".0e") : `${short}.0`;
};
function time(text) { // seconds and nanoseconds, without the rounding of a float
  if (/e/i.test(text)) return decimal(text);
  const [whole, part = ""] = text.replace(/^[-+]/, "").split(".");
  let total = BigInt(whole || "0") * 1_000_000_000n + BigInt(part.padEnd(9, "0").slice(0, 9));
  if (text.startsWith("-")) total = -total;
  let secs = total / 1_000_000_000n, nsecs = total % 1_000_000_000n;
  if (nsecs < 0n) { secs -= 1n; nsecs += 1_000_000_000n; }
  return `{secs: ${secs}, nsecs: ${nsecs}}`;
}
const quoted = (text) => JSON.stringify(String(text)).replace(UNPRINTABLE, (c) => `\\u${c.charCodeAt(0).toString(16).padStart(4, "0")}`);

// -- problems ---------------------------------------------------------------------------------------

// The problem of a field: its own, or one of the items of an array that is one text.
function problemOf(problems, path, field) {
  const own = problems.find((p) => p.path === path);
  if (own) return own.text;
  const item = field && inOneText(field) && problems.find((p) => p.path.startsWith(`${path}[`));
  return item ? `item ${Number(item.path.slice(path.length + 1, -1)) + 1}: ${item.text}` : null;
}

// Problems that no field of the form shows.
export function homeless(problems, fields, state) {
  const homes = new Set();
  const visit = (some, values, path) => {
    for (const field of some) {
      const at = `${path}.${field.name}`;
      homes.add(at);
      if (field.kind === "message" && !field.array) visit(field.fields, values[field.name], at);
      else if (field.array && !inOneText(field)) values[field.name].forEach((item, i) => {
        homes.add(`${at}[${i}]`);
        if (field.kind === "message") visit(field.fields, item, `${at}[${i}]`);
      });
    }
  };
  visit(fields, state, "$");
  return problems.filter((p) => !homes.has(p.path) && !homes.has(p.path.replace(/\[\d+\]$/, "")));
}

const said = (text, value) => (text.endsWith("got str") ? text.replace(/got str$/, String(value).trim() ? `got \u201c${shortened(value)}\u201d` : "got nothing") : text);
const shortened = (text) => (String(text).length > 40 ? `${String(text).slice(0, 40)}\u2026` : text);

// -- the form ---------------------------------------------------------------------------------------

export function Fields({ fields, state, path = "$", problems, disabled, onChange }) {
  return html`${fields.map((field) => html`<${Field} key=${field.name} field=${field} state=${state} path=${`${path}.${field.name}`}
    problems=${problems} disabled=${disabled} onChange=${onChange} />`)}`;
}

function Field({ field, state, path, problems, disabled, onChange }) {
  const put = (value) => { state[field.name] = value; onChange(); };
  const shared = { field, path, problems, disabled, onChange };
  if (field.array && !inOneText(field)) return html`<${Rows} ...${shared} value=${state[field.name]} put=${put} />`;
  if (field.kind === "message") return html`<${Group} ...${shared} name=${field.name} state=${state[field.name]} />`;
  const problem = problemOf(problems, path, field);
  return html`<div class=${`field ${problem ? "bad" : ""}`}>
    <label for=${path}>${field.name}</label><${Type} field=${field} />
    <${Input} ...${shared} value=${state[field.name]} put=${put} bad=${!!problem} />
    <${Comment} field=${field} path=${path} />
    <${Problem} path=${path} text=${problem && said(problem, state[field.name])} /></div>`;
}

const Type = ({ field }) => html`<span class="type">${field.type}</span>`;
function Comment({ field, path }) {
  const words = [field.comment, inOneText(field) ? "separated by commas" : "",
    field.base === "time" ? "seconds, or now" : field.base === "duration" ? "seconds" : ""].filter(Boolean).join("; ");
  return words ? html`<small class="comment" id=${`${path}?`}>${words}</small>` : null;
}
const Problem = ({ path, text }) => (text ? html`<p class="problem" id=${`${path}!`}>${text}</p>` : null);

function Input({ field, path, value, put, bad, disabled, label }) {
  const about = { id: path, disabled, "data-path": path, "aria-invalid": bad, "aria-label": label,
    "aria-describedby": `${path}? ${path}!` };
  if (field.kind === "bool" && !field.array)
    return html`<input type="checkbox" ...${about} checked=${value === true || value === "true"} onChange=${(e) => put(e.target.checked)} />`;
  const text = html`<input type="text" ...${about} value=${value} spellcheck=${false} autocomplete="off"
    inputmode=${field.kind === "float" || field.kind === "integer" ? "decimal" : undefined} class=${field.kind === "string" ? "" : "number-input"}
    placeholder=${field.array ? "empty" : ""} onInput=${(e) => put(e.target.value)} />`;
  if (!field.choices.length || field.array) return text;
  const known = field.choices.some((c) => c.value === String(value).trim());
  return html`<span class="choice"><select aria-label=${`constants for ${field.name}`} disabled=${disabled} value=${known ? String(value).trim() : ""}
      onChange=${(e) => { if (e.target.value !== "") put(e.target.value); }}>
      ${!known && html`<option value="">another value</option>`}
      ${field.choices.map((c) => html`<option value=${c.value} title=${c.comment}>${c.name} = ${c.value}${c.comment ? ` \u2013 ${c.comment}` : ""}</option>`)}
    </select>${text}</span>`;
}

// A message inside the goal; a few numbers, a point for example, share a line.
function Group({ field, name, state, path, problems, disabled, onChange, after }) {
  const few = field.fields.length <= 4 && field.fields.every((f) => f.kind === "float" && !f.array);
  const comment = field.comment || field.about;
  return html`<fieldset class=${`group-field ${few ? "few" : ""}`}><legend>${name} <${Type} field=${field} />${after}</legend>
    ${comment && html`<small class="comment">${comment}</small>`}
    <${Problem} path=${path} text=${problemOf(problems, path)} />
    <div class="inside-group"><${Fields} fields=${field.fields} state=${state} path=${path} problems=${problems} disabled=${disabled} onChange=${onChange} /></div>
    ${!field.fields.length && html`<small class="comment">nothing to fill in</small>`}</fieldset>`;
}

// An array of texts or messages: a row for each.
function Rows({ field, value, put, path, problems, disabled, onChange }) {
  const fixed = field.array.length !== null;
  const fresh = () => (field.kind === "message" ? toState(field.fields, field.default) : "");
  const less = (i) => html`<button type="button" class="small" disabled=${disabled} aria-label=${`remove ${field.name} ${i + 1}`}
    onClick=${() => put(value.filter((_, n) => n !== i))}>\u2212</button>`;
  const inner = { ...field, array: null };
  return html`<fieldset class="group-field rows-field"><legend>${field.name} <${Type} field=${field} /></legend>
    ${field.comment && html`<small class="comment">${field.comment}</small>`}
    <${Problem} path=${path} text=${problemOf(problems, path)} />
    ${value.map((item, i) => {
      const at = `${path}[${i}]`, problem = problemOf(problems, at);
      if (field.kind === "message") return html`<${Group} key=${i} field=${inner} name=${`${field.name} ${i + 1}`} state=${item} path=${at}
        problems=${problems} disabled=${disabled} onChange=${onChange} after=${fixed ? null : less(i)} />`;
      return html`<div class=${`field row-field ${problem ? "bad" : ""}`} key=${i}><${Input} field=${inner} path=${at} value=${item} bad=${!!problem}
        disabled=${disabled} label=${`${field.name} ${i + 1}`} put=${(text) => put(value.map((old, n) => (n === i ? text : old)))} />${!fixed && less(i)}
        <${Problem} path=${at} text=${problem} /></div>`;
    })}
    ${!fixed && html`<button type="button" class="small" disabled=${disabled || value.length >= MOST_ROWS} onClick=${() => put([...value, fresh()])}>+ ${field.name}</button>`}
  </fieldset>`;
}
