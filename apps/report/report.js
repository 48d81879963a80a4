'use strict';
// What moves in a report: sorting of tables, choice of curves, copying of commands, and the viewer of pictures.
(() => {
const byId = id => document.getElementById(id);
const all = (selector, root = document) => [...root.querySelectorAll(selector)];
const make = (tag, properties = {}, ...children) => {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
};
const clamp = (value, low, high) => Math.min(high, Math.max(low, value));
const minus = text => text.replace('-', '\u2212');

// --- page ---------------------------------------------------------------------------------------------------------

const themes = ['auto', 'light', 'dark'];
const themeButton = byId('theme');
if (themeButton) themeButton.addEventListener('click', () => {
  const root = document.documentElement;
  const next = themes[(themes.indexOf(root.dataset.theme || 'auto') + 1) % themes.length];
  if (next === 'auto') delete root.dataset.theme; else root.dataset.theme = next;
  themeButton.textContent = 'Colours: ' + next;
});

// Rows without a value in the column come last, messages after them.
function sortTable(button) {
  const heading = button.closest('th'), table = button.closest('table'), body = table.tBodies[0];
  const column = heading.cellIndex, numeric = heading.classList.contains('number');
  const order = heading.getAttribute('aria-sort');
  const opposite = { ascending: 'descending', descending: 'ascending' };
  const next = opposite[order] || button.dataset.first;
  const sign = next === 'ascending' ? 1 : -1;
  const key = row => {
    const cell = row.cells.length === heading.parentNode.cells.length ? row.cells[column] : null;
    if (!cell) return null;
    if (!numeric) return cell.firstChild ? cell.firstChild.textContent : '';
    return cell.dataset.value === undefined ? null : Number(cell.dataset.value);
  };
  const rows = [...body.rows].map(row => ({ row, key: key(row), message: row.cells.length !== heading.parentNode.cells.length }));
  rows.sort((a, b) => {
    if (a.message !== b.message) return a.message ? 1 : -1;
    if ((a.key === null) !== (b.key === null)) return a.key === null ? 1 : -1;
    if (a.key === null) return 0;
    return sign * (numeric ? a.key - b.key : a.key.localeCompare(b.key));
  });
  all('thead th', table).forEach(th => th.setAttribute('aria-sort', 'none'));
  heading.setAttribute('aria-sort', next);
  body.append(...rows.map(item => item.row));
}
all('th[aria-sort] > button').forEach(button => button.addEventListener('click', () => sortTable(button)));

// Only what can be scrolled needs to be reached.
const trimTabStops = () => all('.table').forEach(box => {
  if (box.scrollWidth > box.clientWidth + 1) box.tabIndex = 0; else box.removeAttribute('tabindex');
});
addEventListener('resize', trimTabStops);
trimTabStops();

all('[data-choose]').forEach(button => button.addEventListener('click', () => {
  const [group, value] = button.dataset.choose.split('=');
  all(`[data-choose^="${group}="]`).forEach(other => other.setAttribute('aria-pressed', String(other === button)));
  all(`[data-group="${group}"]`).forEach(part => { part.hidden = part.dataset.value !== value; });
}));

// The line of a method in all plots of a figure.
function highlight(figure, name) {
  figure.classList.toggle('choosing', name !== null);
  all('.series', figure).forEach(line => line.classList.toggle('on', line.dataset.series === name));
}
all('figure.curves').forEach(figure => {
  all('[data-line]', figure).forEach(button => {
    for (const event of ['pointerenter', 'focus']) button.addEventListener(event, () => highlight(figure, button.dataset.line));
    for (const event of ['pointerleave', 'blur']) button.addEventListener(event, () => highlight(figure, null));
  });
  all('.series', figure).forEach(line => {
    line.addEventListener('pointerenter', () => highlight(figure, line.dataset.series));
    line.addEventListener('pointerleave', () => highlight(figure, null));
  });
});

async function copyText(source, button) {
  try {
    await navigator.clipboard.writeText(source.textContent);
  } catch {  // refused, or an old browser
    const range = document.createRange();
    range.selectNodeContents(source);
    getSelection().removeAllRanges();
    getSelection().addRange(range);
    document.execCommand('copy');
  }
  const label = button.textContent;
  button.textContent = 'Copied';
  setTimeout(() => { button.textContent = label; }, 1500);
}
all('button.copy').forEach(button => button.addEventListener('click', () => copyText(byId(button.dataset.copies), button)));

// --- data of the viewer -------------------------------------------------------------------------------------------

const dataElement = byId('report-data');
if (!dataElement) return;
const data = JSON.parse(dataElement.textContent);

const state = {
  light: 0, who: 'r', peek: null, left: 'r', budget: data.budgets[0].key, mode: 'image', layout: 'one',
  exposure: data.exposure, fit: true, zoom: 1, x: data.width / 2, y: data.height / 2, split: 0.5,
  cursor: null, frame: 0, playing: false,
};
const light = () => data.lights[state.light];
const members = () => ['r', ...light().methods];
const nameOf = who => who === 'r' ? 'reference' : data.methods[who].name;
const shownWho = () => state.peek !== null ? state.peek : state.who;
const imageKey = who => who === 'r' ? `r/${state.light}/${state.frame}` : `m/${who}/${state.budget}/${state.frame}`;
const flipKey = who => `f/${who}/${state.budget}`;
const biasKey = who => `${who}/${state.budget}`;

// Codes of embedded pictures as RGBA bytes, decoded when first needed; the oldest are forgotten.
const decoded = new Map();
const kMostDecoded = 96;
async function decode(picture) {
  const text = byId(picture.id).textContent;
  const bytes = Uint8Array.from(atob(text), c => c.charCodeAt(0));
  const bitmap = await createImageBitmap(new Blob([bytes], { type: picture.type }),
                                         { colorSpaceConversion: 'none', premultiplyAlpha: 'none' });
  const canvas = make('canvas', { width: picture.w, height: picture.h });
  const context = canvas.getContext('2d', { willReadFrequently: true });
  context.drawImage(bitmap, 0, 0);
  return { w: picture.w, h: picture.h, codes: context.getImageData(0, 0, picture.w, picture.h).data };
}
function codesOf(key) {
  const picture = data.pictures[key];
  if (!picture) return null;
  let entry = decoded.get(key);
  if (!entry) {
    entry = { value: null };
    entry.promise = decode(picture).then(value => { entry.value = value; schedule(); });
    decoded.set(key, entry);
    if (decoded.size > kMostDecoded) decoded.delete(decoded.keys().next().value);
  }
  return entry.value;
}

// --- light and colours --------------------------------------------------------------------------------------------

const toLinear = e => e <= 0.04045 ? e / 12.92 : ((e + 0.055) / 1.055) ** 2.4;
const toSrgb = v => v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055;
// Codes are srgb(x*s / (1 + x*s)) * 256 with s = 2^EV of the results; see compand.h.
const companding = 2 ** data.exposure;
const linear = Float32Array.from({ length: 256 }, (_, code) => {
  const squeezed = toLinear(code / 256);
  return squeezed / (1 - squeezed) / companding;
});
function toneMapped(value) {  // as the program does it
  let x = value * 2 ** state.exposure;
  if (!(x > 0)) return 0;
  if (data.tone === 'filmic') {
    x *= 0.6;
    x = x > 1e4 ? 1 : x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14);
  }
  return x < 1 ? toSrgb(x) : 1;
}
const luminance = (r, g, b) => 0.2126 * r + 0.7152 * g + 0.0722 * b;

function blueWhiteRed(t) {
  t = clamp(t, -1, 1);
  const end = t < 0 ? [0.02, 0.19, 0.70] : [0.70, 0.02, 0.09], a = Math.abs(t);
  return end.map(c => 255 * (1 - a + a * c));
}
// Polynomial fit of the table "magma" (van der Walt, Smith 2015), as in the program.
const magmaTerms = [[-0.0021, -0.0007, -0.0095], [0.2505, 0.6945, 2.4953], [8.3459, -3.5960, 0.3291],
  [-27.6670, 14.2539, -13.6466], [52.1707, -27.9446, 12.8811], [-50.7586, 29.0539, 4.2699], [18.6643, -11.4900, -5.5708]];
function magma(t) {
  const color = [0, 0, 0];
  for (let power = 6; power >= 0; --power) for (let c = 0; c < 3; ++c) color[c] = color[c] * t + magmaTerms[power][c];
  return color.map(c => 255 * clamp(c, 0, 1));
}
const magmaTable = Array.from({ length: 256 }, (_, i) => magma(i / 255));
const kNoBias = [150, 150, 150], kNoBlock = [90, 90, 90];
// The faintest bias that is no noise must not look like none.
const biasColor = t => blueWhiteRed(t === 0 ? 0 : Math.sign(t) * (0.2 + 0.8 * Math.abs(t)));

// --- pictures as they are shown -----------------------------------------------------------------------------------

function painted(w, h, color, width = data.width, height = data.height) {
  const canvas = make('canvas', { width: w, height: h });
  const context = canvas.getContext('2d');
  const image = context.createImageData(w, h), out = image.data;
  for (let i = 0; i < w * h; ++i) {
    const [r, g, b] = color(i);
    out[4 * i] = r; out[4 * i + 1] = g; out[4 * i + 2] = b; out[4 * i + 3] = 255;
  }
  context.putImageData(image, 0, 0);
  return { canvas, width, height };  // the latter in pixels of the picture
}

function paintImage(test) {
  const shown = Uint8Array.from(linear, value => Math.round(255 * toneMapped(value))), codes = test.codes;
  const canvas = make('canvas', { width: test.w, height: test.h }), context = canvas.getContext('2d');
  const image = context.createImageData(test.w, test.h), out = image.data;
  for (let i = 0; i < codes.length; ++i) out[i] = (i & 3) === 3 ? 255 : shown[codes[i]];
  context.putImageData(image, 0, 0);
  return { canvas, width: data.width, height: data.height };
}
const luminanceAt = (c, i) => luminance(linear[c[4 * i]], linear[c[4 * i + 1]], linear[c[4 * i + 2]]);
function paintSigned(reference, test) {
  return painted(test.w, test.h, i => {
    const r = luminanceAt(reference.codes, i), t = luminanceAt(test.codes, i);
    return blueWhiteRed(r + t > 0 ? (t - r) / (t + r) : 0);
  });
}
function paintAbsolute(reference, test) {
  const a = reference.codes, b = test.codes;
  // Indexed by a rounded difference: a power per pixel would be slow.
  const steps = 4096, largest = 1 / 2 ** state.exposure * 8, table = new Uint8Array(steps + 1);
  for (let i = 0; i <= steps; ++i) table[i] = Math.round(255 * toneMapped(largest * (i / steps) ** 2));
  const shown = k => table[Math.min(steps, Math.round(steps * Math.sqrt(Math.abs(linear[a[k]] - linear[b[k]]) / largest)))];
  return painted(test.w, test.h, i => [shown(4 * i), shown(4 * i + 1), shown(4 * i + 2)]);
}
function paintBias(bias) {
  const codes = Uint8Array.from(atob(bias.codes), c => c.charCodeAt(0));
  return painted(bias.columns, bias.rows, i => codes[i] === 0 ? kNoBlock : codes[i] === 128 ? kNoBias
    : biasColor((codes[i] - 128) / 127), bias.columns * data.block, bias.rows * data.block);
}

// What stands in the way of showing a picture; null: nothing.
function problem(who, mode) {
  const missing = key => data.missing[key] || 'not in this report';
  if (!data.pictures[imageKey(who)]) return missing(imageKey(who));
  if (who === 'r' || mode === 'image') return null;
  if (mode === 'flip') {
    if (state.frame > 0) return 'FLIP maps are embedded for the first frame only';
    return data.pictures[flipKey(who)] ? null : missing(flipKey(who));
  }
  if (mode === 'bias') {
    if (state.frame > 0) return 'bias maps are embedded for the first frame only';
    return data.bias[biasKey(who)] ? null : data.biasMissing || missing('b/' + biasKey(who));
  }
  return data.pictures[imageKey('r')] ? null : 'there is no reference';
}

const shownCache = new Map();
const kMostShown = 32;
// null while something is still being decoded, or when there is a problem.
function present(who, mode) {
  if (problem(who, mode)) return null;
  if (who === 'r') mode = 'image';
  const key = [imageKey(who), mode, mode === 'image' || mode === 'absolute' ? state.exposure : ''].join('|');
  const known = shownCache.get(key);
  if (known) return known;
  let picture = null;
  if (mode === 'bias') {
    picture = paintBias(data.bias[biasKey(who)]);
  } else if (mode === 'flip') {
    const map = codesOf(flipKey(who));
    picture = map && painted(map.w, map.h, i => magmaTable[map.codes[4 * i]]);
  } else {
    const test = codesOf(imageKey(who)), reference = mode === 'image' ? test : codesOf(imageKey('r'));
    if (test && reference)
      picture = mode === 'image' ? paintImage(test) : (mode === 'signed' ? paintSigned : paintAbsolute)(reference, test);
  }
  if (!picture) return null;
  shownCache.set(key, picture);
  if (shownCache.size > kMostShown) shownCache.delete(shownCache.keys().next().value);
  return picture;
}

// --- drawing ------------------------------------------------------------------------------------------------------

const screen = byId('screen'), canvas = byId('canvas'), context = canvas.getContext('2d', { willReadFrequently: true });
const divider = byId('divider');

function panesOf(width) {
  if (state.layout !== 'grid') {
    const height = Math.min(width * data.height / data.width, Math.max(240, innerHeight * 0.82));
    const rect = { x: 0, y: 0, w: width, h: height };
    const at = Math.round(width * state.split);
    return { height, panes: state.layout === 'one' ? [{ who: shownWho(), rect, clip: rect }]
      : [{ who: state.left, rect, clip: { x: 0, y: 0, w: at, h: height } },
         { who: shownWho(), rect, clip: { x: at, y: 0, w: width - at, h: height } }] };
  }
  const shown = members(), columns = Math.min(shown.length, width < 700 ? 2 : shown.length > 4 ? 3 : 2), gap = 4;
  const w = Math.floor((width - gap * (columns - 1)) / columns), h = Math.round(w * data.height / data.width);
  const panes = shown.map((who, i) => {
    const rect = { x: (i % columns) * (w + gap), y: Math.floor(i / columns) * (h + gap), w, h };
    return { who, rect, clip: rect };
  });
  return { height: Math.ceil(shown.length / columns) * (h + gap) - gap, panes };
}

let layout = { height: 0, panes: [] };
const fitZoom = () => {
  const rect = layout.panes[0].rect;
  return Math.min(rect.w / data.width, rect.h / data.height);
};
const zoomNow = () => state.fit ? fitZoom() : state.zoom;
// Of a pixel position of the picture on the canvas.
const toScreen = (rect, x, y) => {
  const zoom = zoomNow(), centre = state.fit ? [data.width / 2, data.height / 2] : [state.x, state.y];
  return [rect.x + rect.w / 2 + (x - centre[0]) * zoom, rect.y + rect.h / 2 + (y - centre[1]) * zoom];
};
const toPicture = (rect, x, y) => {
  const zoom = zoomNow(), centre = state.fit ? [data.width / 2, data.height / 2] : [state.x, state.y];
  return [centre[0] + (x - rect.x - rect.w / 2) / zoom, centre[1] + (y - rect.y - rect.h / 2) / zoom];
};

function writeMessage(rect, text) {
  context.fillStyle = '#e8ebee';
  context.font = '14px system-ui, sans-serif';
  context.textAlign = 'center';
  const words = text.split(' '), lines = [''];
  for (const word of words) {
    const line = (lines[lines.length - 1] + ' ' + word).trim();
    if (context.measureText(line).width > rect.w - 30 && lines[lines.length - 1]) lines.push(word);
    else lines[lines.length - 1] = line;
  }
  lines.forEach((line, i) => context.fillText(line, rect.x + rect.w / 2, rect.y + rect.h / 2 + 18 * (i - (lines.length - 1) / 2)));
}

function writeName(pane, toRight) {
  const text = nameOf(pane.who);
  context.font = '600 12px system-ui, sans-serif';
  context.textAlign = 'left';
  const width = context.measureText(text).width + 12;
  const x = toRight ? pane.clip.x + pane.clip.w - width - 6 : pane.clip.x + 6;
  context.fillStyle = 'rgba(10,12,15,.78)';
  context.fillRect(x, pane.rect.y + 6, width, 20);
  context.fillStyle = '#fff';
  context.fillText(text, x + 6, pane.rect.y + 20);
}

function drawCursor(pane) {
  if (!state.cursor || !state.cursor.keyboard) return;
  const [x, y] = toScreen(pane.rect, state.cursor.x, state.cursor.y), zoom = Math.max(6, zoomNow());
  for (const [color, grow] of [['#000', 1.5], ['#fff', 0.5]]) {
    context.strokeStyle = color;
    context.lineWidth = 1;
    context.strokeRect(x - grow, y - grow, zoom + 2 * grow, zoom + 2 * grow);
  }
}

function drawPane(pane, index) {
  const { clip, rect } = pane;
  context.save();
  context.beginPath();
  context.rect(clip.x, clip.y, clip.w, clip.h);
  context.clip();
  context.fillStyle = '#23272c';
  context.fillRect(clip.x, clip.y, clip.w, clip.h);
  const why = problem(pane.who, state.mode), picture = why ? null : present(pane.who, state.mode);
  if (picture) {
    const [x0, y0] = toScreen(rect, 0, 0), [x1, y1] = toScreen(rect, picture.width, picture.height);
    const [right, bottom] = toScreen(rect, data.width, data.height);
    context.beginPath();
    context.rect(x0, y0, right - x0, bottom - y0);  // maps of blocks may be larger than the picture
    context.clip();
    context.imageSmoothingEnabled = zoomNow() * devicePixelRatio < 1 && state.mode !== 'bias';
    context.imageSmoothingQuality = 'high';
    context.drawImage(picture.canvas, x0, y0, x1 - x0, y1 - y0);
    drawCursor(pane);
  }
  context.restore();
  if (why) writeMessage({ ...rect, x: clip.x, w: clip.w }, `${nameOf(pane.who)}: ${why}`);
  if (state.layout !== 'one') writeName(pane, state.layout === 'slider' && index === 1);
}

function draw() {
  const width = Math.max(1, screen.clientWidth);
  layout = panesOf(width);
  const ratio = devicePixelRatio || 1;
  const w = Math.round(width * ratio), h = Math.round(layout.height * ratio);
  if (canvas.width !== w || canvas.height !== h) {
    canvas.width = w;
    canvas.height = h;
    canvas.style.height = layout.height + 'px';
  }
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, layout.height);
  layout.panes.forEach(drawPane);
  divider.hidden = state.layout !== 'slider';
  divider.style.left = Math.round(width * state.split) + 'px';
  divider.style.height = layout.height + 'px';
  divider.setAttribute('aria-valuenow', String(Math.round(100 * state.split)));
  divider.setAttribute('aria-valuetext', `${Math.round(100 * state.split)} % ${nameOf(state.left)}`);
}

// --- words around the picture -------------------------------------------------------------------------------------

const modeNames = Object.fromEntries(all('option', byId('mode')).map(option => [option.value, option.textContent]));
const signedNumber = value => (value > 0 ? '+' : '') + minus(String(value));
const significant = value => value === 0 ? '0' : Math.abs(value) >= 1e4 || Math.abs(value) < 1e-3 ? minus(value.toExponential(2))
  : minus(Number(value.toPrecision(3)).toString());
const percent = value => Math.round(100 * value) + ' %';
const budgetLabel = () => data.budgets.find(budget => budget.key === state.budget).label;

function sentence() {
  const who = shownWho(), parts = [];
  if (state.layout === 'grid') parts.push('all pictures');
  else if (state.layout === 'slider') parts.push(`${nameOf(state.left)} left of ${nameOf(who)}`);
  else parts.push(nameOf(who));
  if (state.layout === 'grid' || who !== 'r') parts.push(budgetLabel());
  if (data.lights.length > 1) parts.push(light().name);
  parts.push(modeNames[state.mode] + (state.mode !== 'image' && state.layout === 'one' && who === 'r' ? ' (the reference is shown as it is)' : ''));
  if (data.frames.length > 1) parts.push(`frame ${data.frames[state.frame]}`);
  parts.push(`exposure ${signedNumber(state.exposure)} EV`);
  parts.push(`zoom ${percent(zoomNow())}`);
  const why = problem(who, state.mode);
  return parts.join(', ') + (why && state.layout === 'one' ? `: ${why}` : '') + '.';
}

let announcing = 0;
function announce() {
  const text = sentence();
  canvas.setAttribute('aria-label', text);
  clearTimeout(announcing);  // one sentence for a turn of the wheel
  announcing = setTimeout(() => { if (byId('shown').textContent !== text) byId('shown').textContent = text; }, state.playing ? 0 : 120);
}

function valueCells(who) {
  const codes = codesOf(imageKey(who));
  if (!codes) return null;
  const x = clamp(Math.floor(state.cursor.x * codes.w / data.width), 0, codes.w - 1);
  const y = clamp(Math.floor(state.cursor.y * codes.h / data.height), 0, codes.h - 1);
  const at = 4 * (y * codes.w + x);
  return [0, 1, 2].map(c => linear[codes.codes[at + c]]);
}
function fillValues() {
  const body = byId('values').tBodies[0], caption = byId('values-caption');
  if (!state.cursor) {
    caption.textContent = 'Linear RGB under the cursor: point at the picture, or press I, J, K or L';
    body.replaceChildren();
    byId('values').tHead.hidden = true;
    return;
  }
  byId('values').tHead.hidden = false;
  caption.textContent = `Linear RGB at pixel (${state.cursor.x}, ${state.cursor.y}), decoded from the embedded pictures`;
  const reference = valueCells('r');
  body.replaceChildren(...members().map(who => {
    const rgb = valueCells(who), row = make('tr', {}, make('th', { scope: 'row', textContent: nameOf(who) }));
    if (who === shownWho()) row.className = 'current';
    if (!rgb) {
      row.append(make('td', { colSpan: 4, textContent: problem(who, 'image') || '' }));
      return row;
    }
    const y = luminance(...rgb), r = reference && luminance(...reference);
    const off = who === 'r' || !(r > 0) ? '' : ` (${y >= r ? '+' : ''}${minus((100 * (y / r - 1)).toFixed(0))} %)`;
    row.append(...rgb.map(value => make('td', { className: 'number', textContent: significant(value) })),
               make('td', { className: 'number', textContent: significant(y) + off }));
    return row;
  }));
}

function scaleOf() {
  if (state.mode === 'signed')
    return { color: t => blueWhiteRed(2 * t - 1), ticks: [[0, 'black'], [0.25, minus('-50 %')], [0.5, 'equal'], [0.75, '+50 %'], [1, 'reference black']],
             text: 'Signed difference of luminance: (Y - Yr) / (Y + Yr); blue is darker than the reference, red brighter.' };
  if (state.mode === 'flip')
    return { color: magma, ticks: [0, 0.25, 0.5, 0.75, 1].map(t => [t, String(t)]), text: 'FLIP: visible error of each pixel, 0 to 1.' };
  if (state.mode === 'bias') {
    const s = light().biasScale;
    return { color: t => biasColor(2 * t - 1), ticks: [[0, minus('-' + percent(s))], [0.5, '0'], [1, '+' + percent(s)]],
             text: `Mean of ${data.seeds} seeds minus reference in blocks of ${data.block}x${data.block} pixels: (Y - Yr) / (Y + Yr). ` +
                   'Grey: zero lies in the 95 % interval; by chance about one block in twenty has a colour all the same.' };
  }
  if (state.mode === 'absolute') {
    const ticks = [];
    for (const value of [0, 0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1, 3, 10, 30, 100]) {
      const at = toneMapped(value);
      if (at < 0.99 && (ticks.length === 0 || at - ticks[ticks.length - 1][0] > 0.08)) ticks.push([at, String(value)]);
    }
    return { color: t => [255 * t, 255 * t, 255 * t], ticks, text: '|a - r| of each channel, linear, shown with the exposure of the image.' };
  }
  return null;
}
let scaleKey = '';
function fillScale() {
  const scale = scaleOf(), box = byId('scale'), key = [state.mode, state.exposure, state.light].join('|');
  box.hidden = !scale;
  if (!scale || key === scaleKey) return;
  scaleKey = key;
  const ramp = painted(256, 1, i => scale.color(i / 255)).canvas;
  ramp.setAttribute('role', 'img');
  ramp.setAttribute('aria-label', 'Colour scale: ' + scale.ticks.map(tick => tick[1]).join(', '));
  const ticks = make('div', { className: 'ticks' }, ...scale.ticks.map(([at, text]) => {
    const tick = make('span', { textContent: text });
    tick.style.left = 100 * at + '%';
    return tick;
  }));
  ticks.setAttribute('aria-hidden', 'true');
  box.replaceChildren(ramp, ticks, make('p', { textContent: scale.text }));
}

function fillControls() {
  all('button', byId('names')).forEach(button => button.setAttribute('aria-pressed', String(button.dataset.who === String(state.who))));
  all('button', byId('budgets')).forEach(button => button.setAttribute('aria-pressed', String(button.dataset.budget === state.budget)));
  all('button', byId('layouts')).forEach(button => button.setAttribute('aria-pressed', String(button.dataset.layout === state.layout)));
  byId('mode').value = state.mode;
  byId('exposure').value = state.exposure;
  byId('exposure-text').textContent = signedNumber(state.exposure) + ' EV';
  byId('zoom-text').textContent = percent(zoomNow());
  byId('slider-field').hidden = state.layout !== 'slider';
  byId('left').value = String(state.left);
  byId('frame').value = state.frame;
  byId('frame-text').textContent = data.frames[state.frame];
  byId('play').textContent = state.playing ? 'Pause' : 'Play';
}

// --- crops --------------------------------------------------------------------------------------------------------

function showRegion(who, region) {
  Object.assign(state, { who, layout: 'one', fit: false, mode: 'image', x: region.x + region.w / 2, y: region.y + region.h / 2 });
  state.zoom = clamp(Math.floor(Math.min(screen.clientWidth, 900) / (2.5 * region.w)), 1, 16);
  state.cursor = { x: Math.floor(state.x), y: Math.floor(state.y), keyboard: false };
  const calm = matchMedia('(prefers-reduced-motion: reduce)').matches;
  screen.focus({ preventScroll: true });
  byId('viewer').scrollIntoView({ behavior: calm ? 'auto' : 'smooth' });
  schedule();
}
function buildCrops() {
  byId('crops').hidden = light().regions.length === 0;
  byId('crop-rows').replaceChildren(...light().regions.map(region => {
    const title = make('h3', { textContent: region.why });
    title.append(make('small', { textContent: `pixels ${region.x} to ${region.x + region.w - 1}, ${region.y} to ${region.y + region.h - 1}` }));
    const crops = members().map(who => {
      const picture = make('canvas', { width: region.w, height: region.h });
      picture.setAttribute('role', 'img');
      const button = make('button', { type: 'button', className: 'crop' }, picture, make('span', { className: 'crop-name' }));
      button.dataset.who = who;
      button.region = region;
      button.addEventListener('click', () => showRegion(who, region));
      return button;
    });
    return make('div', { className: 'crop-row' }, title, make('div', { className: crops.length > 6 ? 'crop-line many' : 'crop-line' }, ...crops));
  }));
}
let cropsDrawn = '';
function drawCrops() {
  const buttons = all('button.crop');
  const pictures = buttons.map(button => {
    const who = button.dataset.who === 'r' ? 'r' : Number(button.dataset.who);
    return { button, who, picture: present(who, 'image'), why: problem(who, 'image') };
  });
  const key = [state.light, state.budget, state.frame, state.exposure, ...pictures.map(p => p.picture ? 1 : 0)].join('|');
  if (key === cropsDrawn) return;
  cropsDrawn = key;
  for (const { button, who, picture, why } of pictures) {
    const region = button.region, target = button.firstChild, pen = target.getContext('2d');
    const flip = region.flip[`${who}/${state.budget}`];
    const text = nameOf(who) + (why ? `: ${why}` : flip === undefined || state.frame > 0 ? '' : ` ${flip.toFixed(3)}`);
    button.lastChild.textContent = text;
    target.setAttribute('aria-label', `${region.why}: ${text}`);
    pen.clearRect(0, 0, region.w, region.h);
    if (!picture) continue;
    const kx = picture.canvas.width / data.width, ky = picture.canvas.height / data.height;
    pen.imageSmoothingEnabled = false;
    pen.drawImage(picture.canvas, region.x * kx, region.y * ky, region.w * kx, region.h * ky, 0, 0, region.w, region.h);
  }
}

// --- changes ------------------------------------------------------------------------------------------------------

let scheduled = false;
function schedule() {
  if (scheduled) return;
  scheduled = true;
  requestAnimationFrame(() => {
    scheduled = false;
    draw();
    fillControls();
    fillValues();
    fillScale();
    announce();
    drawCrops();
  });
}
function change(values) {
  Object.assign(state, values);
  schedule();
}

function choose(who) { change({ who, peek: null }); }
function step(by) {
  const list = members(), at = list.indexOf(state.who);
  choose(list[(at + by + list.length) % list.length]);
}
function setExposure(value) { change({ exposure: clamp(value, -10, 10) }); }
// Keeps the picture's point under (px, py) of the canvas where it is.
function zoomTo(zoom, px, py) {
  const rect = paneAt(px, py).rect, [x, y] = toPicture(rect, px, py);
  zoom = clamp(zoom, 0.05, 64);
  change({ fit: false, zoom, x: x - (px - rect.x - rect.w / 2) / zoom, y: y - (py - rect.y - rect.h / 2) / zoom });
}
function zoomCentre(factor) {
  const { rect } = layout.panes[0];
  zoomTo(factor === 1 ? 1 : zoomNow() * factor, rect.x + rect.w / 2, rect.y + rect.h / 2);
}
function pan(dx, dy) {
  const zoom = zoomNow(), centre = state.fit ? [data.width / 2, data.height / 2] : [state.x, state.y];
  change({ fit: false, zoom, x: clamp(centre[0] - dx / zoom, 0, data.width), y: clamp(centre[1] - dy / zoom, 0, data.height) });
}
function paneAt(px, py) {
  return layout.panes.find(({ clip }) => px >= clip.x && px < clip.x + clip.w && py >= clip.y && py < clip.y + clip.h) || layout.panes[0];
}
function setLight(index) {
  const methods = data.lights[index].methods;
  change({ light: index, who: methods.includes(state.who) ? state.who : methods[0] ?? 'r', left: 'r', peek: null });
  buildNames();
  buildCrops();
  cropsDrawn = '';
}
function setFrame(frame) { change({ frame: (frame + data.frames.length) % data.frames.length }); }
function moveCursor(dx, dy) {
  const from = state.cursor || { x: Math.floor(data.width / 2), y: Math.floor(data.height / 2) };
  change({ cursor: { x: clamp(from.x + dx, 0, data.width - 1), y: clamp(from.y + dy, 0, data.height - 1), keyboard: true } });
}
function cycleMode() {
  const modes = Object.keys(modeNames);
  change({ mode: modes[(modes.indexOf(state.mode) + 1) % modes.length] });
}
function setSplit(split) { change({ split: clamp(split, 0, 1) }); }

let timer = 0;
function play(playing) {
  clearInterval(timer);
  state.playing = playing && data.frames.length > 1;
  byId('shown').setAttribute('aria-live', state.playing ? 'off' : 'polite');
  if (state.playing)
    timer = setInterval(() => {
      // Waits for pictures that are still being decoded.
      const next = (state.frame + 1) % data.frames.length, now = state.frame;
      state.frame = next;
      const ready = layout.panes.every(pane => problem(pane.who, 'image') || codesOf(imageKey(pane.who)));
      state.frame = now;
      if (ready) setFrame(next);
    }, 1000 / (data.fps || 24));
  schedule();
}

// --- controls -----------------------------------------------------------------------------------------------------

function buildNames() {
  byId('names').replaceChildren(...members().map((who, i) => {
    const key = i <= 9 ? make('kbd', { textContent: String(i) }) : '';
    const button = make('button', { type: 'button' }, key, nameOf(who));
    button.dataset.who = who;
    button.addEventListener('click', () => choose(who));
    button.addEventListener('focus', () => { if (button.matches(':focus-visible')) choose(who); });
    button.addEventListener('pointerenter', event => { if (event.pointerType === 'mouse') change({ peek: who }); });
    button.addEventListener('pointerleave', () => change({ peek: null }));
    return button;
  }));
  byId('left').replaceChildren(...members().map(who => make('option', { value: String(who), textContent: nameOf(who) })));
}
byId('budgets').append(...data.budgets.map(budget => {
  const button = make('button', { type: 'button', textContent: budget.label, title: budget.title });
  button.dataset.budget = budget.key;
  button.addEventListener('click', () => change({ budget: budget.key }));
  return button;
}));
all('button', byId('layouts')).forEach(button => button.addEventListener('click', () => change({ layout: button.dataset.layout })));
byId('light').append(...data.lights.map((item, i) => make('option', { value: String(i), textContent: item.name })));
byId('light-field').hidden = data.lights.length < 2;
byId('light').addEventListener('change', event => setLight(Number(event.target.value)));
byId('mode').addEventListener('change', event => change({ mode: event.target.value }));
byId('left').addEventListener('change', event => change({ left: event.target.value === 'r' ? 'r' : Number(event.target.value) }));
byId('exposure').addEventListener('input', event => setExposure(Number(event.target.value)));
byId('zoom-in').addEventListener('click', () => zoomCentre(Math.SQRT2));
byId('zoom-out').addEventListener('click', () => zoomCentre(Math.SQRT1_2));
byId('zoom-fit').addEventListener('click', () => change({ fit: true }));
byId('zoom-one').addEventListener('click', () => zoomCentre(1));
byId('frame-field').hidden = data.frames.length < 2;
byId('frame').max = data.frames.length - 1;
byId('frame').addEventListener('input', event => setFrame(Number(event.target.value)));
byId('play').addEventListener('click', () => play(!state.playing));
const dialog = byId('keys-dialog');
byId('help').addEventListener('click', () => dialog.showModal());

// --- pointer ------------------------------------------------------------------------------------------------------

const onCanvas = event => {
  const box = canvas.getBoundingClientRect();
  return [event.clientX - box.left, event.clientY - box.top];
};
function pointAt(event) {
  const [px, py] = onCanvas(event), [x, y] = toPicture(paneAt(px, py).rect, px, py).map(Math.floor);
  const inside = x >= 0 && y >= 0 && x < data.width && y < data.height;
  if (inside) change({ cursor: { x, y, keyboard: false } });
}
let drag = null;
canvas.addEventListener('pointerdown', event => {
  if (event.button !== 0) return;
  drag = onCanvas(event);
  canvas.setPointerCapture(event.pointerId);
  canvas.classList.add('dragged');
});
canvas.addEventListener('pointermove', event => {
  if (drag) {
    const [x, y] = onCanvas(event);
    if (x !== drag[0] || y !== drag[1]) pan(x - drag[0], y - drag[1]);
    drag = [x, y];
  } else if (event.movementX || event.movementY) {  // not when the page moves under a pointer at rest
    pointAt(event);
  }
});
for (const end of ['pointerup', 'pointercancel'])
  canvas.addEventListener(end, () => { drag = null; canvas.classList.remove('dragged'); });
canvas.addEventListener('dblclick', event => {
  if (!state.fit && zoomNow() === 1) change({ fit: true }); else zoomTo(1, ...onCanvas(event));
});
// Without the focus the wheel belongs to the page.
screen.addEventListener('wheel', event => {
  if (!event.ctrlKey && !screen.matches(':focus-within')) return;
  event.preventDefault();
  zoomTo(zoomNow() * 2 ** (-clamp(event.deltaY, -120, 120) / 240), ...onCanvas(event));
}, { passive: false });
divider.addEventListener('pointerdown', event => {
  divider.setPointerCapture(event.pointerId);
  event.preventDefault();
  divider.focus();
});
divider.addEventListener('pointermove', event => {
  if (divider.hasPointerCapture(event.pointerId)) setSplit(onCanvas(event)[0] / screen.clientWidth);
});
divider.addEventListener('keydown', event => {
  const by = event.shiftKey ? 0.1 : 0.01;
  const to = { ArrowLeft: state.split - by, ArrowDown: state.split - by, ArrowRight: state.split + by, ArrowUp: state.split + by,
               Home: 0, End: 1, PageDown: state.split - 0.1, PageUp: state.split + 0.1 }[event.key];
  if (to === undefined) return;
  event.preventDefault();
  event.stopPropagation();
  setSplit(to);
});

// --- keys ---------------------------------------------------------------------------------------------------------

const kPan = 60;  // CSS pixels
const shifted = { ArrowLeft: () => pan(kPan, 0), ArrowRight: () => pan(-kPan, 0), ArrowUp: () => pan(0, kPan), ArrowDown: () => pan(0, -kPan) };
const commands = {
  ArrowLeft: () => step(-1), ArrowRight: () => step(1), r: () => choose('r'), R: () => choose('r'),
  b: () => change({ budget: data.budgets[(data.budgets.findIndex(x => x.key === state.budget) + 1) % data.budgets.length].key }),
  v: () => change({ layout: 'one' }), s: () => change({ layout: state.layout === 'slider' ? 'one' : 'slider' }),
  g: () => change({ layout: state.layout === 'grid' ? 'one' : 'grid' }), m: cycleMode,
  e: () => setExposure(state.exposure + 0.5), E: () => setExposure(state.exposure - 0.5),
  '+': () => zoomCentre(Math.SQRT2), '=': () => zoomCentre(Math.SQRT2), '-': () => zoomCentre(Math.SQRT1_2),
  f: () => change({ fit: true }), z: () => zoomCentre(1),
  '[': () => setSplit(state.split - 0.05), ']': () => setSplit(state.split + 0.05),
  i: () => moveCursor(0, -1), j: () => moveCursor(-1, 0), k: () => moveCursor(0, 1), l: () => moveCursor(1, 0),
  I: () => moveCursor(0, -10), J: () => moveCursor(-10, 0), K: () => moveCursor(0, 10), L: () => moveCursor(10, 0),
  ',': () => setFrame(state.frame - 1), '.': () => setFrame(state.frame + 1), p: () => play(!state.playing),
  '?': () => dialog.showModal(),
};
// Keys that an element under the focus has a use for.
function belongsTo(element, key) {
  if (element.closest('dialog')) return true;
  if (element.matches('textarea, select, [contenteditable]')) return true;
  if (element.matches('input')) return !['range', 'checkbox'].includes(element.type) || /^(Arrow|Home|End|Page)/.test(key);
  return element.matches('.table') && key.startsWith('Arrow');
}
addEventListener('keydown', event => {
  if (event.ctrlKey || event.altKey || event.metaKey || event.defaultPrevented || !byId('keys').checked) return;
  if (event.target instanceof Element && belongsTo(event.target, event.key)) return;
  const digit = /^[0-9]$/.test(event.key) ? members()[Number(event.key)] : undefined;
  const command = digit !== undefined ? () => choose(digit) : event.shiftKey && shifted[event.key] || commands[event.key];
  if (!command) return;
  event.preventDefault();
  command();
});

// --- start --------------------------------------------------------------------------------------------------------

buildNames();
setLight(0);
new ResizeObserver(schedule).observe(screen);
// What is likely to be asked for next.
function preload() {
  for (const who of members()) if (data.pictures[imageKey(who)]) codesOf(imageKey(who));
}
(window.requestIdleCallback || setTimeout)(preload);
})();
