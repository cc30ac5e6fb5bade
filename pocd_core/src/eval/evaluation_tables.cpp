#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <ostream>

#include "pocd/common/check.hpp"
#include "pocd/eval/evaluation_report.hpp"
#include "pocd/output/result_csv.hpp"

namespace pocd {
namespace {

/// Mean of the values that are numbers.
class Mean {
 public:
  void add(double value) {
    if (std::isnan(value)) return;
    sum_ += value;
    ++count_;
  }
  double value() const { return count_ > 0 ? sum_ / static_cast<double>(count_) : std::nan(""); }

 private:
  double sum_ = 0.0;
  std::size_t count_ = 0;
};

std::string text(const char* format, double value) {
  if (std::isnan(value)) return "-";
  char out[48];
  std::snprintf(out, sizeof(out), format, value);
  return out;
}
std::string percent(double value) { return text("%.1f", value); }
std::string share(double value) { return text("%.3f", value); }

double median_delay(const std::vector<double>& delays) {
  return delays.empty() ? std::nan("") : delays[(delays.size() - 1) / 2];
}

const std::vector<std::string> kColumns{"method",  "P ref",     "R ref",     "FPR ref",  "P truth",
                                        "R truth", "FPR truth", "F1 change", "F1 place", "false",
                                        "delay",   "ECE",       "CPU ms"};

std::vector<std::string> cells(const MethodSummary& m) {
  const auto object = [&](double value) { return m.objects ? share(value) : std::string("-"); };
  return {m.method,
          percent(m.reference_precision),
          percent(m.reference_recall),
          text("%.2f", m.reference_fpr),
          percent(m.truth_precision),
          percent(m.truth_recall),
          text("%.2f", m.truth_fpr),
          m.objects ? object(m.objects->f1()) : "-",
          m.objects ? object(m.objects->place_f1()) : "-",
          m.objects ? std::to_string(m.objects->false_changes) : "-",
          m.objects ? text("%.0f", median_delay(m.objects->delays())) : "-",
          share(m.calibration.expected_error()),
          text("%.1f", m.cpu_ms_per_frame)};
}

std::vector<std::vector<RunScore>> by_route(const std::vector<RunScore>& runs) {
  std::vector<std::vector<RunScore>> routes;
  for (const RunScore& run : runs) {
    if (routes.empty() || routes.back().front().route != run.route) routes.emplace_back();
    routes.back().push_back(run);
  }
  return routes;
}

void markdown_row(std::ostream& out, const std::vector<std::string>& row) {
  for (const std::string& cell : row) out << "| " << cell << ' ';
  out << "|\n";
}

void markdown_head(std::ostream& out, const std::vector<std::string>& columns) {
  markdown_row(out, columns);
  for (std::size_t i = 0; i < columns.size(); ++i) out << (i == 0 ? "|---" : "|---:");
  out << "|\n";
}

constexpr ChangeKind kKinds[] = {ChangeKind::kRemoved, ChangeKind::kMoved, ChangeKind::kAdded};

const char* to_text(NetVerdict verdict) {
  switch (verdict) {
    case NetVerdict::kRight:
      return "right";
    case NetVerdict::kPartial:
      return "partial";
    case NetVerdict::kNeutral:
      return "neutral";
    case NetVerdict::kFalse:
      return "false";
  }
  return "";
}

std::vector<std::string> place_cells(const std::optional<OrientedBox>& box) {
  if (!box) return {"", "", ""};
  const Eigen::Vector3d& p = box->pose.position_W;
  return {text("%.3f", p.x()), text("%.3f", p.y()), text("%.3f", p.z())};
}

void append(std::vector<std::string>& row, const std::vector<std::string>& more) {
  row.insert(row.end(), more.begin(), more.end());
}

}  // namespace

std::vector<MethodSummary> summarize(const std::vector<RunScore>& runs) {
  std::vector<MethodSummary> summaries;
  if (runs.empty()) return summaries;
  for (std::size_t m = 0; m < runs.front().methods.size(); ++m) {
    MethodSummary summary;
    summary.method = runs.front().methods[m].method;
    Mean values[7];
    std::vector<ObjectScore> objects;
    for (const RunScore& run : runs) {
      const MethodScore& score = run.methods[m];
      ++summary.runs;
      values[0].add(score.by_reference.precision());
      values[1].add(score.by_reference.recall());
      values[2].add(score.by_reference.false_positive_rate());
      if (score.by_truth) {
        values[3].add(score.by_truth->precision());
        values[4].add(score.by_truth->recall());
        values[5].add(score.by_truth->false_positive_rate());
      }
      if (score.objects) objects.push_back(*score.objects);
      summary.calibration.merge(score.calibration);
      summary.removed_or_moved += score.removed_or_moved;
      values[6].add(score.cpu_ms_per_frame);
    }
    summary.reference_precision = values[0].value();
    summary.reference_recall = values[1].value();
    summary.reference_fpr = values[2].value();
    summary.truth_precision = values[3].value();
    summary.truth_recall = values[4].value();
    summary.truth_fpr = values[5].value();
    summary.cpu_ms_per_frame = values[6].value();
    if (!objects.empty()) summary.objects = merge(objects);
    summaries.push_back(std::move(summary));
  }
  return summaries;
}

void print_summary(const std::vector<MethodSummary>& methods, std::ostream& out) {
  std::vector<std::vector<std::string>> rows{kColumns};
  for (const MethodSummary& method : methods) rows.push_back(cells(method));
  std::vector<std::size_t> width(kColumns.size(), 0);
  for (const auto& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i) width[i] = std::max(width[i], row[i].size());
  }
  for (const auto& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      const std::string pad(width[i] - row[i].size() + 2, ' ');
      out << (i == 0 ? row[i] + pad : pad + row[i]);
    }
    out << '\n';
  }
}

void write_markdown(const std::vector<RunScore>& runs, const std::filesystem::path& file) {
  std::ofstream out(file, std::ios::binary);
  const std::vector<MethodSummary> summaries = summarize(runs);
  out << "# Evaluation: " << runs.size() << " runs\n\n";
  markdown_head(out, kColumns);
  for (const MethodSummary& method : summaries) markdown_row(out, cells(method));
  out << "\nChanges of objects, exact kinds (precision / recall / F1):\n\n";
  markdown_head(out, {"method", "REMOVED", "MOVED", "ADDED", "true", "unseen"});
  for (const MethodSummary& m : summaries) {
    if (!m.objects) continue;
    std::vector<std::string> row{m.method};
    for (const ChangeKind kind : kKinds) {
      row.push_back(share(m.objects->precision(kind)) + " / " + share(m.objects->recall(kind)) +
                    " / " + share(m.objects->f1(kind)));
    }
    row.push_back(std::to_string(m.objects->changes.size()));
    row.push_back(std::to_string(m.objects->unseen_changes));
    markdown_row(out, row);
  }
  for (const auto& route : by_route(runs)) {
    out << "\n## " << route.front().route << "\n\n";
    markdown_head(out, kColumns);
    for (const MethodSummary& method : summarize(route)) markdown_row(out, cells(method));
  }
  out.close();
  if (!out) throw InputError(file.string() + ": cannot be written in full");
}

void write_scores_csv(const std::vector<RunScore>& runs, const std::filesystem::path& file) {
  CsvFile csv(
      file,
      "route,seed,method,precision_ref,recall_ref,fpr_ref,precision_truth,recall_truth,fpr_truth,"
      "tp_truth,fp_truth,fn_truth,tn_truth,change_precision,change_recall,change_f1,place_f1,"
      "false_changes,removed_or_moved,median_delay_frames,ece,cpu_ms_per_frame,frames,refused");
  for (const RunScore& run : runs) {
    for (const MethodScore& m : run.methods) {
      const VoxelScore truth = m.by_truth.value_or(VoxelScore{});
      std::vector<std::string> row{run.route, std::to_string(run.seed), m.method};
      const auto number = [&](double value) {
        row.push_back(std::isnan(value) ? "" : text("%.4f", value));
      };
      number(m.by_reference.precision()), number(m.by_reference.recall());
      number(m.by_reference.false_positive_rate());
      number(truth.precision()), number(truth.recall()), number(truth.false_positive_rate());
      for (const std::int64_t n : {truth.true_positives, truth.false_positives,
                                   truth.false_negatives, truth.true_negatives}) {
        row.push_back(std::to_string(n));
      }
      const double none = std::nan("");
      number(m.objects ? m.objects->precision() : none),
          number(m.objects ? m.objects->recall() : none);
      number(m.objects ? m.objects->f1() : none), number(m.objects ? m.objects->place_f1() : none);
      row.push_back(m.objects ? std::to_string(m.objects->false_changes) : "");
      row.push_back(std::to_string(m.removed_or_moved));
      number(m.objects ? median_delay(m.objects->delays()) : none);
      number(m.calibration.expected_error()), number(m.cpu_ms_per_frame);
      row.push_back(std::to_string(m.frames)), row.push_back(std::to_string(m.refused));
      csv.row(row);
    }
  }
  csv.close();
}

void write_changes_csv(const std::vector<RunScore>& runs, const std::filesystem::path& file) {
  CsvFile csv(file,
              "route,seed,method,what,kind,name,verdict,clear_frame,frame,x_before,y_before,z_"
              "before,x_after,"
              "y_after,z_after");
  for (const RunScore& run : runs) {
    for (const MethodScore& m : run.methods) {
      if (!m.objects) continue;
      for (const ObjectScore::Found& found : m.objects->changes) {
        std::vector<std::string> row{run.route,
                                     std::to_string(run.seed),
                                     m.method,
                                     "truth",
                                     to_string(found.truth.change.kind),
                                     found.truth.change.name,
                                     found.exact   ? "found"
                                     : found.place ? "place"
                                                   : "missed",
                                     std::to_string(*found.truth.clear_frame()),
                                     found.exact_frame ? std::to_string(*found.exact_frame) : ""};
        append(row, place_cells(found.truth.change.before));
        append(row, place_cells(found.truth.change.after));
        csv.row(row);
      }
      for (const auto& [net, verdict] : m.objects->nets) {
        std::vector<std::string> row{run.route,
                                     std::to_string(run.seed),
                                     m.method,
                                     "net",
                                     to_string(net.kind),
                                     std::to_string(to_index(net.object)),
                                     to_text(verdict),
                                     "",
                                     std::to_string(net.frame)};
        append(row, place_cells(net.before));
        append(row, place_cells(net.after));
        csv.row(row);
      }
    }
  }
  csv.close();
}

void write_calibration_csv(const std::vector<MethodSummary>& methods,
                           const std::filesystem::path& file) {
  CsvFile csv(file, "method,bin_low,bin_high,count,mean_predicted,share_true");
  for (const MethodSummary& m : methods) {
    for (int b = 0; b < Calibration::kBins; ++b) {
      const Calibration::Bin& bin = m.calibration.bins()[static_cast<std::size_t>(b)];
      if (bin.count == 0) continue;
      const auto n = static_cast<double>(bin.count);
      csv.row({m.method, text("%.1f", b * 0.1), text("%.1f", (b + 1) * 0.1),
               std::to_string(bin.count), text("%.4f", bin.sum_predicted / n),
               text("%.4f", static_cast<double>(bin.true_count) / n)});
    }
  }
  csv.close();
}

}  // namespace pocd
