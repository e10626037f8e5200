#include "tools/report/failure.h"

#include <fmt/format.h>

#include <new>
#include <stdexcept>
#include <system_error>

#include "io/files/errors.h"
#include "tools/report/exit_codes.h"

namespace tagrid {
namespace {

constexpr const char* out_of_memory = "out of memory; a smaller --brick, or fewer threads, need less";

}  // namespace

Failure current_failure() {
  try {
    throw;
  } catch (const UsageError& error) {
    return {exit_usage, error.what()};
  } catch (const BrokenInput& error) {
    return {exit_broken_input, error.what()};
  } catch (const ClosedPipe&) {
    return {exit_world, ""};
  } catch (const WorldError& error) {
    return {exit_world, error.what()};
  } catch (const std::bad_alloc&) {
    return {exit_world, out_of_memory};
  } catch (const std::length_error&) {
    return {exit_world, out_of_memory};
  } catch (const std::system_error& error) {
    return {exit_world, error.what()};
  } catch (const std::exception& error) {
    return {exit_bug, fmt::format("this is a bug: {}; please report it", error.what())};
  }
}

}  // namespace tagrid
