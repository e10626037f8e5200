// tagrid estimate: what encodings of a volume would give, for a list of bounds.

#include "pipeline/estimate/estimate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "io/errors/errors.h"
#include "io/text/text.h"
#include "tools/commands/commands.h"
#include "tools/options/encoding_options.h"
#include "tools/report/failure.h"
#include "tools/report/human_bytes.h"
#include "tools/report/info.h"
#include "tools/report/run_report.h"

namespace tagrid {
namespace {

/// "0,2,5"
std::vector<double> numbers_option(const char* option, const std::string& text,
                                   std::optional<double> (*read)(std::string_view) = finite_number) {
  std::vector<double> numbers;
  if (text.empty()) return numbers;
  for (const std::string_view part : split(text, ',')) {
    const auto number = read(part);
    if (!number || *number < 0)
      throw UsageError("{} {}: must be numbers, with commas between them", option, text);
    numbers.push_back(*number);
  }
  return numbers;
}

struct EstimateCommand {
  std::string input, errors, psnrs, ratios, bits;
  RunOptions run;
  bool overwrite = false;
  EncodingOptions encoding;

  void execute(Ranks& ranks) const {
    run.obey_memory_limit();
    require_volume_input(input, "estimate -");
    const Encoding asked = encoding.checked(run);
    EstimateRun request{
        .input = input, .source = asked.source, .options = asked.options, .resources = run.resources(ranks)};
    request.max_errors = numbers_option("--errors", errors);
    using Kind = ErrorRule::Kind;
    for (const double psnr : numbers_option("--psnr", psnrs)) request.rules.push_back({Kind::psnr, psnr});
    const auto ratio_of = [](std::string_view text) { return finite_number(plain_ratio(text)); };
    for (const double ratio : numbers_option("--ratio", ratios, ratio_of))
      request.rules.push_back({Kind::ratio, ratio});
    for (const double b : numbers_option("--bits", bits)) request.rules.push_back({Kind::bits, b});
    RunReport report(run.json, run.thread_count(), overwrite, "estimate", input, "");
    if (asked.source.raw) warn(run, doubt_of_description(input, *asked.source.raw));
    const EstimateResult result = estimate(request);
    if (!result.doubt_of_noise.empty()) warn(run, "{}: {}", shown_input(input), result.doubt_of_noise);
    for (const UsageError& error : result.out_of_reach) warn(run, "{}", words_of(error));
    const CodingParameters& p = result.parameters;
    // With a slope, a number may come back from samples with another last digit.
    for (const Estimate& e : result.estimates)
      if (!is_float_type(p.type) && std::abs(e.asked_error - e.max_error) > 1e-9 * e.asked_error)
        warn(run, "{}: --errors {}: encode keeps whole steps of the stored samples, so this is {}",
             shown_input(input), e.asked_error, e.max_error);
    report.write({p.dims, p.type, figures_of(result), sample_bytes(p.dims, p.type).value(), 0, nullptr});
    report.keep();
    if (run.quiet || run.json == "-") return;
    fmt::print("{}", text_of(result));
  }

  EstimateResult estimate(EstimateRun& request) const {
    ProgressMeter meter(run.progress, run.quiet, "estimating", 0);
    request.progress = meter.progress();
    request.before_copy = tell_of_copy(run);
    return estimate_encoding(request);
  }

  nlohmann::ordered_json figures_of(const EstimateResult& result) const {
    nlohmann::ordered_json json = settings_json(result.parameters);
    json.erase("max_error");
    json["noise"] = result.noise;
    json["range_of_samples"] = {result.low, result.high};
    json["threads_used"] = result.threads;
    json["bricks"] = result.bricks;
    json["bricks_encoded"] = result.encoded;
    json["estimates"] = nlohmann::ordered_json::array();
    for (const Estimate& e : result.estimates)
      json["estimates"].push_back(
          {{"asked", json_of_request(e)},
           {"max_error",
            e.max_error < 0 ? nlohmann::ordered_json(nullptr) : nlohmann::ordered_json(e.max_error)},
           {"transform_step", e.transform_step > 0 ? nlohmann::ordered_json(e.transform_step)
                                                   : nlohmann::ordered_json(nullptr)},
           {"bytes", std::llround(e.file_bytes)},
           {"ratio", bytes_of(result) / e.file_bytes},
           {"bits_per_voxel", bits_per_voxel(result, e)},
           {"rmse", e.rmse},
           {"psnr", std::isnan(e.psnr) ? nlohmann::ordered_json(nullptr) : nlohmann::ordered_json(e.psnr)},
           {"encoding_seconds", e.encoding_seconds},
           {"search_seconds", e.search_seconds},
           {"decoding_seconds", e.decoding_seconds}});
    json["out_of_reach"] = nlohmann::ordered_json::array();
    for (const UsageError& error : result.out_of_reach) json["out_of_reach"].push_back(words_of(error));
    return json;
  }

  /// {"psnr": 40}; null for the list of usual bounds.
  nlohmann::ordered_json json_of_request(const Estimate& e) const {
    if (e.rule) return {{std::string(setting_of(e.rule->kind).name), e.rule->value}};
    return errors.empty() ? nlohmann::ordered_json(nullptr)
                          : nlohmann::ordered_json{{"max_error", e.asked_error}};
  }

  /// "psnr 40", or the bound that was asked for.
  static std::string request_text(const Estimate& e) {
    if (e.rule) return fmt::format("{} {}", setting_of(e.rule->kind).name, e.rule->value);
    return e.max_error < 0 ? "none" : fmt::format("error {}", e.asked_error);
  }

  static double bytes_of(const EstimateResult& result) {
    return static_cast<double>(sample_bytes(result.parameters.dims, result.parameters.type).value());
  }
  static double bits_per_voxel(const EstimateResult& result, const Estimate& e) {
    return 8 * e.file_bytes / static_cast<double>(result.parameters.domain().volume().count());
  }

  std::string text_of(const EstimateResult& result) const {
    const CodingParameters& p = result.parameters;
    const auto has_rule = [](const Estimate& e) { return e.rule.has_value(); };
    // What a bound was asked for is what it is.
    const bool names_requests = std::ranges::any_of(result.estimates, has_rule);
    const auto request = [&](const std::string& words) {
      return names_requests ? fmt::format("{:<12}", words) : std::string();
    };
    std::string text = fmt::format(
        "{}: {} x {} x {} {}, {}\nnoise: {:.4g} (standard deviation)\n{} of {} bricks were encoded\n\n"
        "{}{:>10} {:>10} {:>8} {:>11} {:>9} {:>10} {:>10}\n",
        printable(input), p.dims.x, p.dims.y, p.dims.z, name_of(p.type),
        human_bytes(static_cast<std::uint64_t>(bytes_of(result))), result.noise, result.encoded,
        result.bricks, request("asked"), "error", "size", "ratio", "bits/voxel", "PSNR", "encoding",
        "decoding");
    for (const Estimate& e : result.estimates)
      text += fmt::format(
          "{}{:>10} {:>10} {:>8.2f} {:>11.4f} {:>9} {:>8.2g} s {:>8.2g} s\n", request(request_text(e)),
          e.max_error < 0        ? "none"
          : e.transform_step > 0 ? fmt::format("{:.4g} w", e.max_error)
                                 : fmt::format("{}", e.max_error),
          human_bytes(static_cast<std::uint64_t>(e.file_bytes)), bytes_of(result) / e.file_bytes,
          bits_per_voxel(result, e), std::isnan(e.psnr) ? "lossless" : fmt::format("{:.2f} dB", e.psnr),
          e.encoding_seconds + e.search_seconds, e.decoding_seconds);
    if (std::ranges::any_of(result.estimates, [](const Estimate& e) { return e.transform_step > 0; }))
      text += "w: coded by a wavelet; most errors are far smaller\n";
    const auto is_psnr = [](const Estimate& e) { return e.rule && e.rule->kind == ErrorRule::Kind::psnr; };
    if (std::ranges::any_of(result.estimates, is_psnr)) text += "psnr D: the file has at least D dB\n";
    if (names_requests) text += "encoding: includes the search for what was asked\n";
    return text;
  }
};

}  // namespace

Action add_estimate_command(CLI::App& app) {
  auto state = std::make_shared<EstimateCommand>();
  CLI::App* command =
      app.add_subcommand("estimate", "Estimate noise, file size, PSNR and time before you encode");
  command->add_option("INPUT", state->input, volume_input_help)->required();
  add_text_option(*command, "--errors", state->errors, "E,E,...",
                  "Maximum errors to try, such as 0,2,5 (default: a list that fits the noise)");
  add_text_option(*command, "--psnr", state->psnrs, "D,D,...", "PSNRs to try, such as 40,45");
  add_text_option(*command, "--ratio", state->ratios, "R,R,...", "Ratios to try, such as 10,40");
  add_text_option(*command, "--bits", state->bits, "B,B,...", "Bits per voxel to try, such as 0.5,1");
  add_encoding_options(*command, state->encoding,
                       {"max-error", "relative-error", "psnr", "ratio", "bits", "parity"});
  add_report_options(*command, state->run, state->overwrite);
  return [state](Ranks& ranks) { state->execute(ranks); };
}

}  // namespace tagrid
