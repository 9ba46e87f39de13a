//! Figures and names as the page writes them.

/// A length in the unit that suits it.
pub fn length(metres: f64) -> String {
    let (value, unit) = match metres.abs() {
        0.0 => return "0 mm".to_owned(),
        m if m < 1e-4 => (metres * 1e6, "µm"),
        m if m < 1.0 => (metres * 1e3, "mm"),
        m if m < 1e4 => (metres, "m"),
        _ => (metres * 1e-3, "km"),
    };
    format!("{} {unit}", three_digits(value))
}

/// An area in square metres.
pub fn area(square_metres: f64) -> String {
    format!("{} m²", three_digits(square_metres))
}

/// A number with three significant digits, thousands set apart.
pub fn three_digits(value: f64) -> String {
    let magnitude = value.abs();
    match magnitude {
        0.0 => "0".to_owned(),
        m if m < 1e-3 => format!("{value:.1e}"),
        m if m < 0.0995 => format!("{value:.4}"),
        m if m < 0.9995 => format!("{value:.3}"),
        m if m < 9.995 => format!("{value:.2}"),
        m if m < 99.95 => format!("{value:.1}"),
        _ => format!("{}{}", if value < 0.0 { "-" } else { "" }, count(magnitude.round() as u64)),
    }
}

/// A whole number, thousands set apart.
pub fn count(number: u64) -> String {
    let digits = number.to_string();
    let groups: Vec<&str> = digits
        .as_bytes()
        .rchunks(3)
        .rev()
        .map(|group| std::str::from_utf8(group).unwrap_or_default())
        .collect();
    groups.join(",")
}

/// Bytes in the unit that suits them.
pub fn bytes(bytes: u64) -> String {
    match bytes {
        0..1_000 => format!("{bytes} B"),
        1_000..1_000_000 => format!("{:.1} kB", bytes as f64 / 1e3),
        _ => format!("{:.2} MB", bytes as f64 / 1e6),
    }
}

/// The last part of a node path.
pub fn node(path: &str) -> &str {
    match path.rsplit('/').next() {
        Some(name) if !name.is_empty() => name,
        _ => "the scene",
    }
}

/// One noun or more of them.
pub fn plural(number: usize, one: &str, more: &str) -> String {
    format!("{} {}", count(number as u64), if number == 1 { one } else { more })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_choose_their_unit() {
        let shown = [0.0, 1.234e-5, 0.00123, 0.25, 12.34, 123_456.0].map(length);
        assert_eq!(shown, ["0 mm", "12.3 µm", "1.23 mm", "250 mm", "12.3 m", "123 km"]);
    }

    #[test]
    fn thousands_are_set_apart() {
        assert_eq!([0, 999, 1_000, 1_234_567].map(count), ["0", "999", "1,000", "1,234,567"]);
        assert_eq!(three_digits(-1234.5), "-1,235");
    }

    #[test]
    fn nodes_are_named_by_their_last_part() {
        assert_eq!([node("A/B"), node("B"), node("")], ["B", "B", "the scene"]);
    }
}
