//! The page in headless Chromium, judged by its pixels. An exit code says little: some flags give
//! a blank picture and exit code 0.

use crate::common;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Messages of the driver that say nothing about the page.
const DRIVER: [&str; 3] = ["GPU stall due to ReadPixels", "software WebGL", "GroupMarkerNotSet"];
/// Hosts the browser itself may call in spite of the flags below.
const BROWSER_HOSTS: [&str; 4] = ["google.com", "googleapis.com", "gstatic.com", "gvt1.com"];

/// The parts of a 1200 x 900 window that show the surface and the diagram: left, top, right,
/// bottom.
const SURFACE: [usize; 4] = [240, 140, 780, 720];
const DIAGRAM: [usize; 4] = [860, 190, 1150, 470];

fn chromium() -> Option<PathBuf> {
    let folders = std::env::var_os("PATH")?;
    let programs = ["chromium", "chromium-browser", "google-chrome"];
    let mut all = std::env::split_paths(&folders).flat_map(|f| programs.map(|p| f.join(p)));
    all.find(|p| p.is_file())
}

struct Page {
    folder: tempfile::TempDir,
    browser: PathBuf,
}

impl Page {
    /// `None`, with a line that names the test, where there is no browser.
    fn written(test: &str) -> Option<Self> {
        Self::holding(test, &common::tori().to_html())
    }

    /// The same of another page.
    fn holding(test: &str, page: &str) -> Option<Self> {
        let Some(browser) = chromium() else {
            eprintln!("SKIPPED {test}: no chromium on PATH");
            return None;
        };
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("page.html"), page).unwrap();
        Some(Self { folder, browser })
    }

    /// Runs the browser on the page with `fragment`, and returns its two outputs.
    fn run(&self, fragment: &str, flags: &[String]) -> (String, String) {
        let profile = tempfile::tempdir().unwrap();
        let output = Command::new(&self.browser)
            .args(["--headless=new", "--no-sandbox", "--hide-scrollbars", "--disable-gpu"])
            .args(["--no-first-run", "--disable-background-networking"])
            .args(["--disable-component-update", "--disable-sync", "--window-size=1200,900"])
            .args(["--virtual-time-budget=4000", "--enable-logging=stderr"])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .args(flags)
            .arg(format!("file://{}/page.html#{fragment}", self.folder.path().display()))
            .stdin(Stdio::null())
            .output()
            .unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
        (text(output.stdout), text(output.stderr))
    }

    fn shot(&self, fragment: &str) -> Picture {
        let path = self.folder.path().join("shot.png");
        let (_, log) = self.run(fragment, &[format!("--screenshot={}", path.display())]);
        let console = log.lines().filter(|l| l.contains("CONSOLE"));
        let complaints: Vec<&str> =
            console.filter(|l| !DRIVER.iter().any(|known| l.contains(known))).collect();
        assert!(complaints.is_empty(), "{complaints:#?}");
        Picture::read(&path)
    }
}

struct Picture {
    width: usize,
    channels: usize,
    bytes: Vec<u8>,
}

impl Picture {
    fn read(path: &Path) -> Self {
        let file = std::io::BufReader::new(std::fs::File::open(path).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut bytes).unwrap();
        Self { width: info.width as usize, channels: info.color_type.samples(), bytes }
    }

    fn pixels(&self, [left, top, right, bottom]: [usize; 4]) -> Vec<[u8; 3]> {
        let at = |x: usize, y: usize| {
            let start = (y * self.width + x) * self.channels;
            [self.bytes[start], self.bytes[start + 1], self.bytes[start + 2]]
        };
        (top..bottom).flat_map(|y| (left..right).map(move |x| at(x, y))).collect()
    }

    fn colours(&self, part: [usize; 4]) -> usize {
        self.pixels(part).into_iter().collect::<BTreeSet<_>>().len()
    }

    fn changed(&self, other: &Self, part: [usize; 4]) -> usize {
        let pairs = self.pixels(part).into_iter().zip(other.pixels(part));
        pairs.filter(|(a, b)| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > 12)).count()
    }
}

#[test]
fn the_surface_is_drawn_and_brushing_works_both_ways() {
    let test = "the_surface_is_drawn_and_brushing_works_both_ways";
    let Some(page) = Page::written(test) else { return };
    let plain = page.shot("stage=after&field=K");
    assert!(plain.colours(SURFACE) > 200, "{} colours", plain.colours(SURFACE));
    assert!(plain.colours(DIAGRAM) > 20, "{} colours", plain.colours(DIAGRAM));
    // The outer side of the torus, K > 0, stays; the inner side fades.
    let brushed = page.shot("stage=after&field=K&brush=-2,0,0,2");
    assert!(plain.changed(&brushed, SURFACE) > 3000);
    assert!(brushed.colours(SURFACE) > 200);
    let picked = page.shot("stage=after&field=K&pick=0.45,0.55,0.65,0.8");
    assert!(plain.changed(&picked, DIAGRAM) > 200, "{}", plain.changed(&picked, DIAGRAM));
    assert!(plain.changed(&picked, SURFACE) > 3000);
}

#[test]
fn the_share_of_a_brush_is_that_of_the_area() {
    let Some(page) = Page::written("the_share_of_a_brush_is_that_of_the_area") else { return };
    let (dom, _) =
        page.run("stage=after&axes=HK&brush=-9,0,9,9&behind=none", &["--dump-dom".to_owned()]);
    let note = dom.split("id=\"brush-note\"").nth(1).unwrap();
    let text = note.split(['>', '%']).nth(1).unwrap();
    // The outer side of a torus, K > 0, has the share 1/2 + r / (π R) of its area.
    let want = 50.0 + 100.0 * 0.9 / (3.0 * std::f64::consts::PI);
    let got: f64 = text.trim().parse().unwrap();
    assert!((got - want).abs() < 2.0, "{got} % instead of {want} %");
    // The key names the stage and the curve of umbilics; no other stage lies behind.
    let key =
        dom.split("id=\"diagram-key\"").nth(1).unwrap().split("</span></span>").next().unwrap();
    assert!(key.contains("after") && key.contains("K = H²") && !key.contains("before"), "{key}");
}

#[test]
fn modes_and_stages_look_different() {
    let Some(page) = Page::written("modes_and_stages_look_different") else { return };
    let shots = ["mode=zebra", "mode=groups", "stage=before", "compare=before&stage=after"]
        .map(|fragment| page.shot(fragment));
    for (i, a) in shots.iter().enumerate() {
        for b in &shots[..i] {
            assert!(a.changed(b, SURFACE) > 3000);
        }
    }
}

#[test]
fn the_title_tells_that_it_is_drawn_and_nothing_is_requested() {
    let test = "the_title_tells_that_it_is_drawn_and_nothing_is_requested";
    let Some(page) = Page::written(test) else { return };
    let log = page.folder.path().join("net.json");
    let flags = ["--dump-dom".to_owned(), format!("--log-net-log={}", log.display())];
    let (dom, _) = page.run("field=H", &flags);
    assert!(dom.contains("<title>Two tori – Umbilic</title>"));
    // The script fills in what changes from run to run.
    assert!(dom.contains("<code id=\"command\">umbilic analyze torus.ron --threads 2</code>"));
    assert!(dom.contains("0.25"));
    let net = std::fs::read_to_string(log).unwrap();
    let urls = net.split("\"url\":\"http").skip(1).map(|rest| rest.split('"').next().unwrap());
    let foreign: Vec<&str> =
        urls.filter(|url| !BROWSER_HOSTS.iter().any(|host| url.contains(host))).collect();
    assert!(foreign.is_empty(), "{foreign:?}");
}

#[test]
fn a_script_that_is_not_the_pages_own_does_not_run() {
    let test = "a_script_that_is_not_the_pages_own_does_not_run";
    let foreign = "<body>\n<script>document.body.append('it ran')</script>\n\
                   <img src=\"data:,\" onerror=\"document.body.append('it ran')\">\n\
                   <style>h1 { color: rgb(1, 2, 3) }</style>\n";
    let page = common::tori().to_html().replacen("<body>\n", foreign, 1);
    let Some(page) = Page::holding(test, &page) else { return };
    let (dom, log) = page.run("field=H", &["--dump-dom".to_owned()]);
    // The page's own script did.
    assert!(dom.contains("<title>Two tori – Umbilic</title>"));
    let after = dom.rsplit("</script>").next().unwrap();
    assert!(!after.contains("it ran"), "{after}");
    let refusals = log.lines().filter(|l| l.contains("CONSOLE") && l.contains("Content Security"));
    assert!(refusals.count() >= 3, "{log}");
}
