// Amplitude of a mode in time: a stable one swings, an unstable one grows and goes back, so that the loop joins.

const FAINTEST = 0.06, GROWS = 0.8, PERIODS = 2;
export const PERIOD = 2400; // milliseconds of a loop

// Real and minus the imaginary part of the amplitude at a time of the loop, from 0 to 1.
export function amplitude(mode, time) {
  const [rate, frequency] = mode.root;
  if (mode.kind !== "grows") return [Math.cos(2 * Math.PI * time), -Math.sin(2 * Math.PI * time)];
  let most = Math.log(1 / FAINTEST) / rate;
  if (frequency) most = Math.min(most, (PERIODS * 2 * Math.PI) / Math.abs(frequency));
  const at = (t) => [Math.exp(rate * t) * Math.cos(frequency * t), -Math.exp(rate * t) * Math.sin(frequency * t)];
  const grown = at(most * (Math.min(time / GROWS, 1) - 1)), first = at(-most);
  const back = Math.max(0, time - GROWS) / (1 - GROWS), share = back * back * (3 - 2 * back);
  return grown.map((x, k) => x + share * (first[k] - x));
}
