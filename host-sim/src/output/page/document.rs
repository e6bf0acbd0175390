//! The frame of a report page: one self-contained HTML file with its style sheet.

use maud::{DOCTYPE, Markup, PreEscaped, html};
use simulation::units::is_usual;

use crate::output::chart;

/// A whole page with its title as the first heading; texts in the title are escaped.
pub(in crate::output) fn document(title: &str, body: Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { (PreEscaped(include_str!("page.css"))) (PreEscaped(chart::STYLE)) }
            }
            body {
                h1 { (title) }
                (PreEscaped(with_units_kept(&body.into_string())))
            }
        }
    };
    page.into_string()
}

/// A sentence of the terminal as markup: what stands between backticks is code.
pub(in crate::output) fn prose(sentence: &str) -> Markup {
    html! {
        @for (index, part) in sentence.split('`').enumerate() {
            @if index % 2 == 0 { (part) } @else { code { (part) } }
        }
    }
}

/// The markup with each number and its unit on one line, except in what is quoted to be copied.
fn with_units_kept(markup: &str) -> String {
    let mut is_quoted = false;
    let kept = markup.split_inclusive('>').map(|piece| {
        let (text, tag) = piece.split_at(piece.find('<').unwrap_or(piece.len()));
        let text = if is_quoted { text.to_owned() } else { unbroken(text) };
        is_quoted = ["<pre>", "<code>"].contains(&tag);
        text + tag
    });
    kept.collect()
}

/// The text with a no-break space between a number, or its interval, and the unit after it.
fn unbroken(text: &str) -> String {
    let mut words = text.split(' ');
    let mut joined = words.next().unwrap_or_default().to_owned();
    for word in words {
        let is_unit = word.trim_end_matches([',', ';', ':', '.', ')']).split('/').all(is_usual);
        let is_value = joined.ends_with(|letter: char| letter.is_ascii_digit() || letter == ']');
        joined.push(if is_unit && is_value { '\u{a0}' } else { ' ' });
        joined += word;
    }
    joined
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn backticks_become_code() {
        let html = prose("a < b; `vsj plan` computes it").into_string();
        assert_eq!(html, "a &lt; b; <code>vsj plan</code> computes it");
    }

    #[test]
    fn no_line_breaks_between_a_number_and_its_unit() {
        let body = html! {
            p title="5 s" { "from 28.53 to 1.019 V, by 96.4 %. A width of 70.79 [70.69, 70.89] V; 2 of 3 records, 0.15 mm/kV" }
            code { "--known 2 s" }
            b { "2 s" }
        };
        let page = document("", body);
        for part in [
            "from 28.53 to 1.019\u{a0}V, by 96.4\u{a0}%. A width of 70.79 [70.69, 70.89]\u{a0}V; 2 of 3 records, 0.15\u{a0}mm/kV<",
            r#"title="5 s""#,
            "--known 2 s",
            "<b>2\u{a0}s<",
        ] {
            assert!(page.contains(part), "{part}: {page}");
        }
    }
}
