//! `cargo xtask peers`: what a user would pick instead, measured beside ours in one run.
//!
//! The peers come from PyPI into `target/peers`, their C and C++ programs (`crates/xtask/peers/`) are compiled there once, at -O3 -march=native. Ours is the bench
//! `yardstick` of `certune-closed-loop`, compiled as a user would. Each row is measured in rounds, ours and theirs in turn on one core by the thread's CPU
//! time, so that a busy machine slows both; the medians are compared.
//!
//! The column "of peak" is `operations / (ns * peak)`: the operations of a work are counted by a scalar that counts, the peak is what chains of multiply-adds in
//! the machine's widest registers reach on one core in the same run.

mod lyapunov;
mod search;
mod tuners;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

pub use search::search;
pub use tuners::compare;

use crate::{Outcome, cargo, root, run, venv};

/// Rounds of ours and theirs in turn; odd, so that the median is one of them.
const ROUNDS: usize = 9;

const PACKAGES: [&str; 5] = ["pin==4.1.0", "cmeel-eigen==3.4.1", "mujoco==4.0.0", "cvxpy==1.9.3", "clarabel==0.11.1"];

/// What is compared: the row's words, our work, whose program, its work, and the largest acceptable share of their time.
const ROWS: [(&str, &str, Peer, &str, f64); 10] = [
    ("closed loop, all instructions", "closed-loop", Peer::MuJoCo, "closed-loop", 1.0 / 5.0),
    ("closed loop, all instructions", "closed-loop", Peer::Pinocchio, "closed-loop", 1.0 / 6.0),
    ("closed loop, AVX2", "closed-loop-avx2", Peer::MuJoCo, "closed-loop", 1.0 / 5.0),
    ("closed loop, AVX2", "closed-loop-avx2", Peer::Pinocchio, "closed-loop", 1.0 / 6.0),
    ("ABA, one state", "aba", Peer::Pinocchio, "aba", 0.5),
    ("RNEA, one state", "rnea", Peer::Pinocchio, "rnea", 0.5),
    ("CRBA, one state", "crba", Peer::Pinocchio, "crba", 0.7),
    ("linearisation, one state", "linearise", Peer::Pinocchio, "linearise", 0.5),
    ("gravity torque, one state", "gravity", Peer::Pinocchio, "gravity", 1.0),
    ("AIC step, 7 joints", "aic", Peer::Pinocchio, "aic", 1.0),
];

/// The most that an MRAC step may cost, in AIC steps.
const MRAC_AIM: f64 = 20.0;

/// The most that a chain may be off the line through all of them, per cent.
const LINE_AIM: f64 = 20.0;

/// Joints of the chains whose cost should grow along a line.
const CHAINS: [usize; 5] = [2, 4, 7, 14, 28];

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Peer {
    MuJoCo,
    Pinocchio,
}

impl Peer {
    const fn name(self) -> &'static str {
        match self {
            Self::MuJoCo => "MuJoCo",
            Self::Pinocchio => "Pinocchio",
        }
    }
}

/// The programs that are run in turn.
struct Programs {
    ours: PathBuf,
    mujoco: PathBuf,
    mjcf: PathBuf,
    pinocchio: PathBuf,
    model: PathBuf,
}

impl Programs {
    fn peer(&self, peer: Peer) -> (&Path, &Path) {
        match peer {
            Peer::MuJoCo => (&self.mujoco, &self.mjcf),
            Peer::Pinocchio => (&self.pinocchio, &self.model),
        }
    }

    /// What our program says to these words.
    fn ours(&self, words: &[&str]) -> Result<f64, String> {
        number(&said(Command::new(&self.ours).args(words))?)
    }

    fn ours_ns(&self, work: &str) -> Result<f64, String> {
        number(&said(Command::new(&self.ours).arg(work))?)
    }

    fn theirs_ns(&self, peer: Peer, work: &str) -> Result<f64, String> {
        let (program, model) = self.peer(peer);
        number(&said(Command::new(program).arg(model).arg(work))?)
    }
}

/// Sets up, measures, prints.
///
/// # Errors
/// A step of the set-up that failed, or a program that printed no figure.
pub fn peers() -> Outcome {
    let folder = folder()?;
    let programs = set_up(&folder)?;
    same_arm(&programs)?;
    table(&programs)?;
    lines(&programs)?;
    lyapunov::table(&folder)
}

/// Where the peers live.
fn folder() -> Result<PathBuf, String> {
    let folder = root().join("target/peers");
    fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    Ok(folder)
}

fn set_up(folder: &Path) -> Result<Programs, String> {
    let python = venv::python(folder, "venv", &PACKAGES)?;
    let site = said(Command::new(python).args(["-c", "import sysconfig; print(sysconfig.get_path('purelib'))"]))?;
    let site = PathBuf::from(site.trim());
    let sources = root().join("crates/xtask/peers");

    let mujoco = site.join("mujoco");
    let library = fs::read_dir(&mujoco)
        .map_err(|e| format!("{}: {e}", mujoco.display()))?
        .filter_map(Result::ok)
        .map(|entry| entry.path())
        .find(|path| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("libmujoco.so")))
        .ok_or("the wheel of MuJoCo holds no libmujoco.so")?;
    let mujoco_program = folder.join("mujoco");
    let mut cc = Command::new("cc");
    cc.args(["-O3", "-march=native", "-DNDEBUG", "-I"])
        .arg(mujoco.join("include"))
        .arg(sources.join("mujoco.c"))
        .arg(&library);
    cc.arg(format!("-Wl,-rpath,{}", mujoco.display())).args(["-lm", "-o"]).arg(&mujoco_program);
    compiled(&mujoco_program, &sources.join("mujoco.c"), "MuJoCo's program", cc)?;

    let include = site.join("cmeel.prefix/include");
    let pinocchio_program = folder.join("pinocchio");
    let mut cxx = Command::new("c++");
    cxx.args(["-O3", "-march=native", "-DNDEBUG", "-std=c++17"]);
    // Pinocchio's variants have more members than Boost's lists hold by default.
    cxx.args([
        "-DBOOST_MPL_LIMIT_LIST_SIZE=30",
        "-DBOOST_MPL_LIMIT_VECTOR_SIZE=30",
        "-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS",
    ]);
    cxx.arg("-DBOOST_FUSION_INVOKE_MAX_ARITY=12").arg("-I").arg(&include).arg("-I").arg(include.join("eigen3"));
    cxx.arg(sources.join("pinocchio.cpp")).arg("-o").arg(&pinocchio_program);
    compiled(&pinocchio_program, &sources.join("pinocchio.cpp"), "Pinocchio's program (minutes, 4 GB)", cxx)?;

    let ours = bench("certune-closed-loop", "yardstick")?;
    let (model, mjcf) = (folder.join("panda.txt"), folder.join("panda.xml"));
    for (file, what) in [(&model, "model"), (&mjcf, "mjcf")] {
        fs::write(file, said(Command::new(&ours).arg(what))?).map_err(|e| format!("{}: {e}", file.display()))?;
    }
    Ok(Programs { ours, mujoco: mujoco_program, mjcf, pinocchio: pinocchio_program, model })
}

/// Compiles unless the program is younger than its source.
fn compiled(program: &Path, source: &Path, title: &str, command: Command) -> Outcome {
    let age = |path: &Path| fs::metadata(path).and_then(|data| data.modified()).ok();
    match (age(program), age(source)) {
        (Some(program), Some(source)) if program > source => Ok(()),
        _ => run(title, command),
    }
}

/// The path of a bench of ours, built.
fn bench(package: &str, name: &str) -> Result<PathBuf, String> {
    built(&["bench", "--package", package, "--bench", name, "--no-run"], name)
}

/// The path of the executable `name` that cargo builds when told `words`.
fn built(words: &[&str], name: &str) -> Result<PathBuf, String> {
    let messages = said(cargo(words).arg("--message-format=json").current_dir(root()))?;
    // One message a line; the last executable of that name is meant.
    let executable = |line: &str| {
        let rest = line.split("\"executable\":\"").nth(1)?;
        Some(PathBuf::from(rest.split('"').next()?))
    };
    messages
        .lines()
        .filter(|line| line.contains(&format!("\"name\":\"{name}\"")))
        .filter_map(executable)
        .next_back()
        .ok_or_else(|| format!("cargo named no executable for {name}"))
}

/// What a program prints.
fn said(command: &mut Command) -> Result<String, String> {
    let output = command.output().map_err(|e| format!("cannot start {command:?}: {e}"))?;
    if !output.status.success() {
        return Err(format!("{command:?}: {}\n{}", output.status, String::from_utf8_lossy(&output.stderr)));
    }
    String::from_utf8(output.stdout).map_err(|e| format!("{command:?}: {e}"))
}

/// The figure behind the work's name.
fn number(line: &str) -> Result<f64, String> {
    let figure = line.split_whitespace().nth(1).and_then(|word| word.parse::<f64>().ok());
    figure.filter(|x| x.is_finite()).ok_or_else(|| format!("no figure in {line:?}"))
}

/// Both sides must mean the same arm.
fn same_arm(programs: &Programs) -> Outcome {
    const RELATIVE: f64 = 1e-9;
    let ours = said(Command::new(&programs.ours).arg("check"))?;
    let theirs = said(Command::new(&programs.pinocchio).arg(&programs.model).arg("check"))?;
    let numbers = |text: &str| text.split_whitespace().filter_map(|word| word.parse().ok()).collect::<Vec<f64>>();
    let (ours, theirs) = (numbers(&ours), numbers(&theirs));
    let near = |(a, b): (&f64, &f64)| (a - b).abs() <= RELATIVE * (1.0 + b.abs());
    if ours.len() == 7 && theirs.len() == 7 && ours.iter().zip(&theirs).all(near) {
        Ok(())
    } else {
        Err(format!("accelerations differ: {ours:?} and Pinocchio's {theirs:?}"))
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

fn table(programs: &Programs) -> Outcome {
    let mut ours: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    let mut theirs: BTreeMap<(Peer, &str), Vec<f64>> = BTreeMap::new();
    for _ in 0..ROUNDS {
        for (_, work, peer, their_work, _) in ROWS {
            if ours.get(work).is_none_or(|seen| seen.len() < ROUNDS) {
                ours.entry(work).or_default().push(programs.ours_ns(work)?);
            }
            let seen = theirs.entry((peer, their_work)).or_default();
            if seen.len() < ROUNDS {
                seen.push(programs.theirs_ns(peer, their_work)?);
            }
        }
        ours.entry("mrac").or_default().push(programs.ours_ns("mrac")?);
    }
    let peak = median((0..ROUNDS).map(|_| programs.ours(&["peak"])).collect::<Result<_, _>>()?);
    let of_peak = |work: &str, ns: f64| Ok::<_, String>(100.0 * programs.ours(&["operations", work])? / (ns * peak));
    println!("\none core's peak: {peak:.1} operations a ns");
    println!("{:<32} {:>9} {:>8} {:>9}  {:<10} {:>7} {:>7}", "work, ns", "ours", "of peak", "peer", "", "share", "aim");
    let print = |title: &str, mine: f64, of_peak: f64, other: f64, name: &str, aim: f64| {
        let share = mine / other;
        let met = if share <= aim { "" } else { "  not met" };
        println!("{title:<32} {mine:>9.1} {of_peak:>6.1} % {other:>9.1}  {name:<10} {share:>7.3} {aim:>7.3}{met}");
    };
    for (title, work, peer, their_work, aim) in ROWS {
        let (mine, other) = (median(ours[work].clone()), median(theirs[&(peer, their_work)].clone()));
        print(title, mine, of_peak(work, mine)?, other, peer.name(), aim);
    }
    let (mrac, aic) = (median(ours["mrac"].clone()), median(ours["aic"].clone()));
    print("MRAC step over AIC step", mrac, of_peak("mrac", mrac)?, aic, "our AIC", MRAC_AIM);
    Ok(())
}

/// The closed loop of chains against the number of joints, and how far it is from a straight line.
fn lines(programs: &Programs) -> Outcome {
    let mut seen = CHAINS.map(|joints| (joints, Vec::new()));
    for _ in 0..ROUNDS {
        for (joints, ns) in &mut seen {
            ns.push(programs.ours_ns(&format!("chain-{joints}"))?);
        }
    }
    let points = seen.map(|(joints, ns)| (joints as f64, median(ns)));
    // Deviations are shares of the time, so the line is fitted to shares: each point weighs as its inverse square.
    let sum = |of: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(|p| of(p) / (p.1 * p.1)).sum::<f64>();
    let weight = sum(&|_| 1.0);
    let (x, y) = (sum(&|p| p.0) / weight, sum(&|p| p.1) / weight);
    let slope = sum(&|p| (p.0 - x) * (p.1 - y)) / sum(&|p| (p.0 - x) * (p.0 - x));
    let at = |joints: f64| y + slope * (joints - x);
    let off = |(joints, ns): &(f64, f64)| 100.0 * (ns / at(*joints) - 1.0);
    println!("\nclosed loop of chains, least squares of the shares: {:.1} ns + {slope:.1} ns a joint", at(0.0));
    for point in &points {
        println!("{:>4.0} joints {:>9.1} ns, {:+.1} % of the line", point.0, point.1, off(point));
    }
    let worst = points.iter().map(|point| off(point).abs()).fold(0.0, f64::max);
    let met = if worst <= LINE_AIM { "" } else { "  not met" };
    println!("worst deviation {worst:.1} %, aim {LINE_AIM:.0} %{met}");
    Ok(())
}
