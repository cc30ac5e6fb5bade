// Colours of the scene in both themes, and of E[v].

export const themes = {
  dark: { ground: 0x0f141a, wall: 0x8d99a6, floor: 0x55606c, grid: 0x2b3743, text: 0xe8edf2, ghost: 0xff6b6b, moved: 0xf2b134,
    added: 0x5ab0ff, unknown: 0xb79cf2, robot: 0x5fd4ea, selected: 0xffffff, measure: 0x5ab0ff },
  light: { ground: 0xeef1f4, wall: 0xb9c3cc, floor: 0xd9dfe5, grid: 0xc9d2da, text: 0x15202b, ghost: 0xc02530, moved: 0xb87407,
    added: 0x0b63c4, unknown: 0x6b46c1, robot: 0x00738a, selected: 0x15202b, measure: 0x0b63c4 },
};

const scale = [[0, [0xd7, 0x40, 0x4a]], [0.5, [0xf2, 0xb1, 0x34]], [1, [0x2a, 0xa5, 0x8c]]];

/** E[v] in [0, 1] as [r, g, b] in [0, 255]: red moves, yellow in between, green stays. */
export function colourOfScore(v) {
  const score = Math.min(1, Math.max(0, v));
  const upper = score <= 0.5 ? 1 : 2;
  const [from, a] = scale[upper - 1], [to, b] = scale[upper];
  const t = (score - from) / (to - from);
  return a.map((value, i) => Math.round(value + t * (b[i] - value)));
}

export const rgbOf = (hex) => [(hex >> 16) & 255, (hex >> 8) & 255, hex & 255];
