//! A conversation in JSON lines: a value a line, both ways, each sent at once.

use std::io::{BufRead, BufReader, ErrorKind, Stdin, Stdout, Write};

use serde::Serialize;

use crate::error::Error;

/// The two streams, from this program's side.
pub struct Lines<R, W> {
    input: R,
    output: W,
    text: Vec<u8>,
    /// Lines heard, blank ones included.
    heard: usize,
}

#[derive(Serialize)]
#[serde(rename_all = "snake_case")]
enum Refusal<'a> {
    Error { line: usize, message: &'a str },
}

impl Lines<BufReader<Stdin>, Stdout> {
    /// Standard input and output.
    pub fn standard() -> Self {
        Self::new(BufReader::new(std::io::stdin()), std::io::stdout())
    }
}

impl<R: BufRead, W: Write> Lines<R, W> {
    pub fn new(input: R, output: W) -> Self {
        Self { input, output, text: Vec::new(), heard: 0 }
    }

    /// The next line that is not blank; none when the input has ended.
    pub fn hear(&mut self) -> Result<Option<&[u8]>, Error> {
        loop {
            self.text.clear();
            if self.input.read_until(b'\n', &mut self.text).map_err(Error::Stdin)? == 0 {
                return Ok(None);
            }
            self.heard += 1;
            if !self.text.iter().all(u8::is_ascii_whitespace) {
                return Ok(Some(&self.text));
            }
        }
    }

    /// Says one value.
    pub fn say(&mut self, said: &impl Serialize) -> Result<(), Error> {
        let text = serde_json::to_string(said)? + "\n";
        self.output.write_all(text.as_bytes()).and_then(|()| self.output.flush()).map_err(Error::Stdout)
    }

    /// Says what keeps the line heard last from being used: `{"error":{"line":7,"message":".."}}`.
    pub fn refuse(&mut self, message: &str) -> Result<(), Error> {
        self.say(&Refusal::Error { line: self.heard, message })
    }
}

/// Whether the other side has stopped listening, which is its right.
pub fn nobody_listens(error: &Error) -> bool {
    matches!(error, Error::Stdout(source) if source.kind() == ErrorKind::BrokenPipe)
}
