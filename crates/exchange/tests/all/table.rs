//! Makes the table of formats and features in `docs/formats.md`: what a format keeps is what a test
//! shows. `UMBILIC_BLESS=1` writes the table anew.

use std::fmt::Write;
use std::path::{Path, PathBuf};

const FEATURES: [&str; 14] = [
    "surfaces",
    "rational",
    "periodic",
    "trims",
    "meshes",
    "polygons",
    "groups",
    "polylines",
    "numbers",
    "colours",
    "names",
    "layers",
    "creases",
    "unit",
];

const JSON: &str = "round_trips::surfaces_come_back_bit_for_bit_from_json";
const MESHES: &str = "round_trips::meshes_come_back_bit_for_bit";
const SURFACES: &str = "round_trips::surfaces_come_back_bit_for_bit";
const TRIMS: &str = "round_trips::trims_come_back_bit_for_bit";

/// What a format keeps: the feature, the test of reading it, the test of writing it.
type Row = (&'static str, &'static [(&'static str, &'static str, &'static str)]);

const TABLE: [Row; 9] = [
    (
        "RON scene",
        &[
            ("surfaces", SURFACES, SURFACES),
            ("rational", SURFACES, SURFACES),
            ("periodic", SURFACES, SURFACES),
            ("trims", TRIMS, TRIMS),
            ("colours", "scene::trims_and_colours_come_back", "scene::trims_and_colours_come_back"),
            ("names", SURFACES, SURFACES),
            ("unit", SURFACES, SURFACES),
        ],
    ),
    (
        "STEP",
        &[
            ("surfaces", SURFACES, SURFACES),
            ("rational", SURFACES, SURFACES),
            ("periodic", SURFACES, SURFACES),
            (
                "trims",
                "step_faces::sweeps_and_cut_solids_have_their_areas",
                "step_faces::trimmed_solids_come_back",
            ),
            (
                "colours",
                "step_faces::a_bracket_has_the_faces_that_it_was_made_of",
                "step_faces::trimmed_solids_come_back",
            ),
            ("names", "step_faces::raw_latin_1_is_read", SURFACES),
            ("unit", "step_faces::parts_stand_where_the_assembly_puts_them_in_one_unit", SURFACES),
        ],
    ),
    (
        "3DM",
        &[
            (
                "surfaces",
                "rhino::files_of_rhino_have_their_areas_in_closed_form",
                "round_trips::surfaces_come_back_from_rhino",
            ),
            (
                "rational",
                "round_trips::surfaces_come_back_from_rhino",
                "rhino::rational_control_points_keep_all_but_the_last_bit",
            ),
            (
                "periodic",
                "round_trips::surfaces_come_back_from_rhino",
                "rhino::splines_names_layers_and_colours_come_back",
            ),
            ("trims", "rhino::files_of_rhino_have_their_areas_in_closed_form", TRIMS),
            ("meshes", "rhino::files_of_rhino_have_their_areas_in_closed_form", MESHES),
            ("polygons", MESHES, "rhino::meshes_keep_polygons_positions_and_colours"),
            ("groups", "", "rhino::groups_become_objects_on_layers"),
            (
                "polylines",
                "rhino::files_of_rhino_have_their_areas_in_closed_form",
                "rhino::groups_become_objects_on_layers",
            ),
            (
                "colours",
                "rhino::files_of_rhino_have_their_areas_in_closed_form",
                "rhino::splines_names_layers_and_colours_come_back",
            ),
            (
                "names",
                "rhino::files_of_rhino_have_their_areas_in_closed_form",
                "rhino::splines_names_layers_and_colours_come_back",
            ),
            (
                "layers",
                "rhino::files_of_rhino_have_their_areas_in_closed_form",
                "rhino::splines_names_layers_and_colours_come_back",
            ),
            (
                "unit",
                "rhino::files_of_rhino_have_their_areas_in_closed_form",
                "rhino::grids_become_points_and_units_of_their_own_stay",
            ),
        ],
    ),
    (
        "OBJ",
        &[
            ("surfaces", "obj_freeform::a_spline_surface_is_read_with_u_first", ""),
            ("rational", "obj_freeform::bezier_pieces_weights_and_ranges", ""),
            ("trims", "obj_freeform::trims_and_holes_are_planar_curves_by_number", ""),
            ("meshes", MESHES, MESHES),
            ("polygons", MESHES, MESHES),
            (
                "groups",
                "obj::quads_groups_lines_and_negative_indices",
                "obj::quads_groups_lines_and_negative_indices",
            ),
            (
                "polylines",
                "obj::quads_groups_lines_and_negative_indices",
                "obj::quads_groups_lines_and_negative_indices",
            ),
            ("colours", "", "obj::quads_groups_lines_and_negative_indices"),
            (
                "creases",
                "obj_tags::creases_and_corners_come_back",
                "obj_tags::creases_and_corners_come_back",
            ),
        ],
    ),
    (
        "PLY",
        &[
            ("meshes", MESHES, MESHES),
            ("polygons", MESHES, MESHES),
            (
                "groups",
                "formats::meshes_are_bit_equal_in_text_formats_and_ply",
                "formats::meshes_are_bit_equal_in_text_formats_and_ply",
            ),
            (
                "numbers",
                "formats::meshes_are_bit_equal_in_text_formats_and_ply",
                "formats::meshes_are_bit_equal_in_text_formats_and_ply",
            ),
            (
                "unit",
                "formats::meshes_are_bit_equal_in_text_formats_and_ply",
                "formats::meshes_are_bit_equal_in_text_formats_and_ply",
            ),
        ],
    ),
    (
        "OFF",
        &[
            ("meshes", "off::mixed_polygons_comments_and_colours", ""),
            ("polygons", "off::mixed_polygons_comments_and_colours", ""),
        ],
    ),
    ("STL", &[("meshes", "stl::ascii_and_flat_triangles", "stl::corners_are_welded_again")]),
    (
        "GLB",
        &[
            (
                "meshes",
                "glb::node_trees_strides_and_normalised_colours",
                "glb::models_far_from_the_origin_keep_their_place",
            ),
            (
                "groups",
                "formats::glb_keeps_triangles_materials_and_values",
                "formats::glb_keeps_triangles_materials_and_values",
            ),
            (
                "polylines",
                "formats::glb_keeps_triangles_materials_and_values",
                "formats::glb_keeps_triangles_materials_and_values",
            ),
            (
                "numbers",
                "formats::sampled_surfaces_carry_exact_normals_and_curvatures",
                "formats::sampled_surfaces_carry_exact_normals_and_curvatures",
            ),
            (
                "colours",
                "glb::node_trees_strides_and_normalised_colours",
                "formats::sampled_surfaces_carry_exact_normals_and_curvatures",
            ),
            ("names", "glb::node_trees_strides_and_normalised_colours", ""),
        ],
    ),
    (
        "JSON",
        &[
            ("surfaces", JSON, JSON),
            ("rational", JSON, JSON),
            ("periodic", JSON, JSON),
            ("meshes", MESHES, MESHES),
            ("polygons", MESHES, MESHES),
        ],
    ),
];

const BEGIN: &str =
    "<!-- table of features: begin (made by the test `table` of the crate exchange) -->\n";
const END: &str = "<!-- table of features: end -->\n";

fn table() -> String {
    let mut tests: Vec<&str> = Vec::new();
    let mut text =
        format!("| | {} |\n|{}\n", FEATURES.join(" | "), "---|".repeat(FEATURES.len() + 1));
    for (format, cells) in TABLE {
        let _ = write!(text, "| {format} |");
        for feature in FEATURES {
            let mut cell = Vec::new();
            if let Some((_, read, written)) = cells.iter().find(|(name, ..)| *name == feature) {
                for (letter, test) in [('r', read), ('w', written)] {
                    if !test.is_empty() {
                        let known = tests.iter().position(|t| t == test);
                        let number = known.unwrap_or_else(|| {
                            tests.push(test);
                            tests.len() - 1
                        });
                        cell.push(format!("{letter}{}", number + 1));
                    }
                }
            }
            let _ = write!(text, " {} |", cell.join(" "));
        }
        text.push('\n');
    }
    text.push_str("\nr: read, w: written; the numbers are those of the tests that show it:\n");
    for (k, test) in tests.iter().enumerate() {
        let _ = writeln!(text, "{}. `{test}`", k + 1);
    }
    text
}

#[test]
fn the_table_of_the_manual_is_that_of_the_tests() {
    let crate_folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let path: PathBuf = crate_folder.join("../../docs/formats.md");
    let manual = std::fs::read_to_string(&path).unwrap();
    let (before, rest) = manual.split_once(BEGIN).unwrap();
    let (found, after) = rest.split_once(END).unwrap();
    let wanted = table();
    if std::env::var_os("UMBILIC_BLESS").is_some() {
        std::fs::write(&path, format!("{before}{BEGIN}{wanted}{END}{after}")).unwrap();
        return;
    }
    assert_eq!(found, wanted, "run this test with UMBILIC_BLESS=1");
}

#[test]
fn every_test_of_the_table_is_there() {
    let crate_folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    for (format, cells) in TABLE {
        for (feature, read, written) in cells {
            assert!(FEATURES.contains(feature), "{format}: {feature}");
            for test in [read, written].into_iter().filter(|t| !t.is_empty()) {
                let (file, name) = test.split_once("::").unwrap();
                let source =
                    ["tests/all", "src"].map(|f| crate_folder.join(f).join(format!("{file}.rs")));
                let found = source.iter().any(|source| {
                    let text = std::fs::read_to_string(source).unwrap_or_default();
                    text.contains(&format!("#[test]\n    fn {name}("))
                        || text.contains(&format!("#[test]\nfn {name}("))
                });
                assert!(found, "{format}, {feature}: there is no test {test}");
            }
        }
    }
}
