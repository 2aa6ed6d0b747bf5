//! What leaves the program: tables, wrapped text, JSON, and files that are written whole or not at all.

use std::fmt::Write as _;
use std::fs::File;
use std::io::{ErrorKind, Write as _};
use std::path::{Path, PathBuf};

use serde::Serialize;
use tempfile::NamedTempFile;

use crate::error::Error;

/// How the names of files begin that are not in their places yet.
const STAGED: &str = ".autotune-";

/// Columns that running text is wrapped to.
const WIDTH: usize = 100;

/// One line on stderr. A closed stderr is nobody to tell.
pub fn say(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}

/// The result on stdout. A reader that has gone away (`| head`) is no error.
pub fn print(text: &str) -> Result<(), Error> {
    let mut stdout = std::io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(Error::Stdout(error)),
        Ok(()) | Err(_) => Ok(()),
    }
}

/// The result as JSON on stdout.
pub fn print_json(value: &impl Serialize) -> Result<(), Error> {
    print(&(serde_json::to_string_pretty(value)? + "\n"))
}

/// Rows under a header: the first column to the left, numbers to the right.
pub fn table(header: &[&str], rows: &[Vec<String>]) -> String {
    let columns = rows.iter().map(Vec::len).chain([header.len()]).max().unwrap_or(0);
    let header: Vec<String> = header.iter().map(|cell| (*cell).to_owned()).collect();
    let all = || std::iter::once(&header).filter(|header| !header.is_empty()).chain(rows);
    let width =
        |column: usize| all().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut text = String::new();
    for row in all() {
        let mut line = String::new();
        for (column, (cell, width)) in row.iter().zip(&widths).enumerate() {
            let _ = if column == 0 { write!(line, "  {cell:<width$}") } else { write!(line, "  {cell:>width$}") };
        }
        let _ = writeln!(text, "{}", line.trim_end());
    }
    text
}

/// Two columns, both to the left: names and what they are.
pub fn list(rows: &[(String, String)]) -> String {
    let width = rows.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    rows.iter().map(|(name, words)| format!("  {name:<width$}  {words}\n")).collect()
}

/// Running text in lines, each behind `indent` blanks.
pub fn wrapped(text: &str, indent: usize) -> String {
    let mut lines = String::new();
    let mut line = String::new();
    for word in text.split_whitespace() {
        if !line.is_empty() && indent + line.chars().count() + 1 + word.chars().count() > WIDTH {
            let _ = writeln!(lines, "{:indent$}{line}", "");
            line.clear();
        }
        if !line.is_empty() {
            line.push(' ');
        }
        line.push_str(word);
    }
    let _ = writeln!(lines, "{:indent$}{line}", "");
    lines
}

/// A number for a table, with `digits` decimals; a dash where there is none.
pub fn number(value: Option<f64>, digits: usize) -> String {
    match value.filter(|value| value.is_finite()) {
        // A rounded minus zero is zero.
        Some(value) => {
            let text = format!("{value:.digits$}");
            if text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.') {
                text.trim_start_matches('-').to_owned()
            } else {
                text
            }
        }
        None => "-".to_owned(),
    }
}

/// A file, written to a temporary name beside it and not there yet.
pub struct Staged {
    file: NamedTempFile,
    path: PathBuf,
}

pub fn cannot(action: &'static str, path: &Path) -> impl FnOnce(std::io::Error) -> Error {
    let path = path.to_path_buf();
    move |source| Error::Io { action, path, source }
}

impl Staged {
    /// Writes `content` beside `path`; the file at `path` stays as it is. A link is followed, so that it is the file that changes.
    pub fn write(path: &Path, content: &str) -> Result<Self, Error> {
        let stage = || {
            let target = match std::fs::metadata(path) {
                Ok(there) if there.is_file() => std::fs::canonicalize(path)?,
                Ok(there) if there.is_dir() => return Err(ErrorKind::IsADirectory.into()),
                // A device or a pipe must never be replaced by a file.
                Ok(_) => return Err(std::io::Error::other("not a regular file")),
                Err(_) => path.to_path_buf(),
            };
            let folder = match target.parent() {
                Some(folder) if !folder.as_os_str().is_empty() => folder,
                Some(_) | None => Path::new("."),
            };
            let mut builder = tempfile::Builder::new();
            builder.prefix(STAGED);
            #[cfg(unix)]
            {
                // A temporary file is private; a result is as readable as any file (the umask still applies).
                use std::os::unix::fs::PermissionsExt as _;
                builder.permissions(std::fs::Permissions::from_mode(0o666));
            }
            let mut file = builder.tempfile_in(folder)?;
            file.write_all(content.as_bytes())?;
            file.as_file().sync_all()?;
            Ok(Self { file, path: target.clone() })
        };
        stage().map_err(cannot("write", path))
    }

    /// Puts the file in its place, open, and locked by this process before anybody can see it; none when something is there already.
    pub fn commit_new_locked(self) -> Result<Option<File>, Error> {
        let path = self.path;
        self.file.as_file().lock().map_err(cannot("lock", &path))?;
        match self.file.persist_noclobber(&path) {
            Ok(file) => Ok(Some(file)),
            Err(error) if error.error.kind() == ErrorKind::AlreadyExists => Ok(None),
            Err(error) => Err(cannot("write", &path)(error.error)),
        }
    }

    /// Puts the file in its place, over whatever was there.
    pub fn commit(self) -> Result<(), Error> {
        let path = self.path;
        self.file.persist(&path).map(|_| ()).map_err(|error| cannot("write", &path)(error.error))
    }
}

/// Writes files beside their places, all of them or none; [`commit`] puts them there.
pub fn stage(files: &[(PathBuf, String)]) -> Result<Vec<Staged>, Error> {
    files.iter().map(|(path, content)| Staged::write(path, content)).collect()
}

/// Puts files in their places.
pub fn commit(staged: Vec<Staged>) -> Result<(), Error> {
    staged.into_iter().try_for_each(Staged::commit)
}

/// Whether something is there that must be written into and not replaced: a device or a pipe.
pub fn is_device(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|there| !there.is_file() && !there.is_dir())
}

/// Makes sure that a file can be written, before the work whose result it is to hold; the file itself stays as it is.
pub fn check_writable(path: &Path) -> Result<(), Error> {
    if is_device(path) {
        return Ok(());
    }
    Staged::write(path, "").map(drop)
}

/// Writes one file whole or not at all; into a device or a pipe (`/dev/stdout`) the content is simply written.
pub fn write_file(path: &Path, content: &str) -> Result<(), Error> {
    if is_device(path) {
        let write = || std::fs::OpenOptions::new().write(true).open(path)?.write_all(content.as_bytes());
        return write().map_err(cannot("write", path));
    }
    Staged::write(path, content)?.commit()
}

/// The text of a file.
pub fn read_file(path: &Path) -> Result<String, Error> {
    std::fs::read_to_string(path).map_err(cannot("read", path))
}

/// Creates a folder with its parents, and makes sure that files can be made in it.
pub fn prepare_folder(path: &Path) -> Result<(), Error> {
    let create = || {
        std::fs::create_dir_all(path)?;
        tempfile::Builder::new().prefix(STAGED).tempfile_in(path).map(drop)
    };
    create().map_err(cannot("create", path))
}

/// Removes what a process that was killed had not put in its place.
pub fn remove_staged(folder: &Path) {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    for entry in entries.filter(|entry| entry.file_name().to_string_lossy().starts_with(STAGED)) {
        // What cannot be removed is no harm: nobody reads it.
        let _ = std::fs::remove_file(entry.path());
    }
}

/// Removes a file that a run no longer stands for; one that is not there is as good.
pub fn remove_file(path: &Path) -> Result<(), Error> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(cannot("remove", path)(error)),
        Ok(()) | Err(_) => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_aligned() {
        let rows = vec![vec!["a".to_owned(), "1.0".to_owned()], vec!["long".to_owned(), "-10.0".to_owned()]];
        assert_eq!(table(&["", "x"], &rows), "            x\n  a       1.0\n  long  -10.0\n");
    }

    #[test]
    fn wrapped_text_keeps_every_word_and_the_width() {
        let text = "word ".repeat(100);
        let lines = wrapped(&text, 4);
        assert_eq!(lines.split_whitespace().count(), 100);
        assert!(lines.lines().all(|line| line.len() <= WIDTH && line.starts_with("    word")));
    }

    #[test]
    fn a_number_that_is_not_there_is_a_dash() {
        assert_eq!(number(None, 2), "-");
        assert_eq!(number(Some(f64::NAN), 2), "-");
        assert_eq!(number(Some(-0.0004), 2), "0.00");
        assert_eq!(number(Some(-0.5), 2), "-0.50");
    }

    #[test]
    fn a_staged_file_is_invisible_until_it_is_committed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.json");
        drop(Staged::write(&path, "abandoned").unwrap());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        write_file(&path, "one").unwrap();
        write_file(&path, "two").unwrap();
        assert_eq!(read_file(&path).unwrap(), "two");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn what_is_no_file_is_never_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let socket = folder.path().join("socket");
        let _listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
        assert!(Staged::write(&socket, "x").is_err() && write_file(&socket, "x").is_err());
        assert!(!std::fs::metadata(&socket).unwrap().is_file());

        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        std::fs::write(&file, "old").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        write_file(&link, "new").unwrap();
        assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(read_file(&file).unwrap(), "new");
    }
}
