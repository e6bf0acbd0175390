// Range and ticks of an axis.

/** An axis over some values; `margin` is the part of their range by which it extends beyond them. */
export function axis(values, margin = 0) {
  let [low, high] = [Infinity, -Infinity];
  for (const value of values) {
    low = Math.min(low, value);
    high = Math.max(high, value);
  }
  if (low > high) [low, high] = [0, 1];
  if (low === high) {
    const alone = low === 0 ? 1 : 0.1 * Math.abs(low);
    [low, high] = [low - alone, high + alone];
  }
  const more = margin * (high - low);
  return { low: low - more, high: high + more };
}

/** At most `most` multiples of 1, 2 or 5 times a power of ten on an axis, with their labels. */
export function ticks({ low, high }, most) {
  let power = Math.floor(Math.log10((high - low) / most));
  for (;; power++) {
    for (const digit of [1, 2, 5]) {
      const step = digit * 10 ** power;
      const [first, last] = [Math.ceil(low / step - 1e-9), Math.floor(high / step + 1e-9)];
      if (last - first + 1 > most) continue;
      const decimals = Math.max(0, -power);
      const label = (value) => (decimals > 4 || Math.abs(value) >= 1e6 ? value.toExponential(1) : value.toFixed(decimals));
      return Array.from({ length: last - first + 1 }, (_, index) => {
        const value = (first + index) * step;
        return { value, label: value === 0 ? "0" : label(value) };
      });
    }
  }
}
