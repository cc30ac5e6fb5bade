// Scores of many runs as tables and pictures.
#pragma once

#include <filesystem>
#include <iosfwd>

#include "pocd/eval/evaluation.hpp"

namespace pocd {

/// Means over runs (voxel shares and CPU), or counts put together (objects, calibration), of one
/// method.
struct MethodSummary {
  std::string method;
  std::size_t runs = 0;
  double reference_precision = 0, reference_recall = 0, reference_fpr = 0;
  double truth_precision = 0, truth_recall = 0, truth_fpr = 0;  ///< NaN without truth
  std::optional<ObjectScore> objects;
  Calibration calibration;
  std::size_t removed_or_moved = 0;
  double cpu_ms_per_frame = 0;
};

/// By method, in the order of the first run. Runs in which a share is undefined do not enter its
/// mean.
std::vector<MethodSummary> summarize(const std::vector<RunScore>& runs);

/// Console table of the summaries.
void print_summary(const std::vector<MethodSummary>& methods, std::ostream& out);
/// The same in Markdown, with one table per topic and one row per route below.
void write_markdown(const std::vector<RunScore>& runs, const std::filesystem::path& file);
/// One line per run and method; one per true change and per net change.
void write_scores_csv(const std::vector<RunScore>& runs, const std::filesystem::path& file);
void write_changes_csv(const std::vector<RunScore>& runs, const std::filesystem::path& file);
/// Bins of the reliability curve by method.
void write_calibration_csv(const std::vector<MethodSummary>& methods,
                           const std::filesystem::path& file);

/// Bird's eye: green true, yellow missed, red false; the most serious of a column is shown.
void draw_voxels(const VoxelScore& score, double voxel_size_m, const std::string& title,
                 const std::filesystem::path& file);
/// E[v] over frames of up to eight objects: those with events REMOVED or MOVED first, then the
/// longest.
void draw_histories(const MethodScore& score, double remove_below,
                    const std::filesystem::path& file);
/// Share that is true over predicted E[v].
void draw_reliability(const Calibration& calibration, const std::string& title,
                      const std::filesystem::path& file);

}  // namespace pocd
