//! Colours of what is good and what is not, where a terminal has them and NO_COLOR does not forbid.

/// Green, yellow, red, and back.
const GREEN: &str = "\x1b[32m";
const YELLOW: &str = "\x1b[33m";
const RED: &str = "\x1b[31m";
const RESET: &str = "\x1b[0m";

/// Words of reports, with the colour they have.
const WORDS: [(&str, &str); 9] = [
    ("verdict: optimal", GREEN),
    ("verdict: verified and", GREEN),
    ("verdict: verified but not converged", YELLOW),
    ("verdict: not flyable", RED),
    ("TOO LARGE", RED),
    ("BROKEN", RED),
    ("disagrees:", RED),
    ("warning:", YELLOW),
    ("the machine was busy", YELLOW),
];

/// A report for standard output.
pub(super) fn painted(text: String) -> String {
    if console::colors_enabled() { paint(text) } else { text }
}

/// The word that begins an error on standard error.
pub(super) fn error_word() -> String {
    let word = "error:";
    if console::colors_enabled_stderr() { format!("{RED}{word}{RESET}") } else { word.into() }
}

fn paint(text: String) -> String {
    WORDS
        .iter()
        .fold(text, |text, (word, colour)| text.replace(word, &format!("{colour}{word}{RESET}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn verdicts_have_colours() {
        let text = paint("verdict: not flyable, x\n".into());
        assert_eq!(text, "\x1b[31mverdict: not flyable\x1b[0m, x\n");
        assert_eq!(paint("stage".into()), "stage");
    }
}
