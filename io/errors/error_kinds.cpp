#include "io/errors/error_kinds.h"

#include <new>
#include <stdexcept>
#include <system_error>

#include "io/errors/errors.h"

namespace tagrid {

SortedError sorted_error(const std::exception_ptr& exception) {
  try {
    std::rethrow_exception(exception);
  } catch (const UsageError& error) {
    return {ErrorKind::usage, error.what(), error.detail()};
  } catch (const BrokenInput& error) {
    return {ErrorKind::broken_input, error.what(), error.detail()};
  } catch (const ClosedPipe& error) {
    return {ErrorKind::closed_pipe, error.what(), error.detail()};
  } catch (const WorldError& error) {
    return {ErrorKind::world, error.what(), error.detail()};
  } catch (const std::bad_alloc& error) {
    return {ErrorKind::memory, error.what(), {}};
  } catch (const std::length_error& error) {
    // A container was asked for more elements than any memory holds.
    return {ErrorKind::memory, error.what(), {}};
  } catch (const std::system_error& error) {
    if (error.code() == std::errc::resource_unavailable_try_again)
      return {ErrorKind::world,
              "the system cannot create more threads; raise its limit on processes (ulimit -u) or on address "
              "space (ulimit -v)",
              {}};
    return {ErrorKind::world, error.what(), {}};
  } catch (const std::exception& error) {
    return {ErrorKind::bug, error.what(), {}};
  } catch (...) {
    return {ErrorKind::bug, "an exception of an unknown type was thrown", {}};
  }
}

void throw_sorted(const SortedError& error) {
  switch (error.kind) {
    case ErrorKind::usage:
      if (error.detail.problem == Problem::memory_limit) throw MemoryLimit(error.message, error.detail);
      throw UsageError(error.message, error.detail);
    case ErrorKind::broken_input:
      throw BrokenInput(error.message, error.detail);
    case ErrorKind::closed_pipe:
      throw ClosedPipe(error.message, error.detail);
    case ErrorKind::world:
      throw WorldError(error.message, error.detail);
    case ErrorKind::memory:
      throw std::bad_alloc();
    case ErrorKind::bug:
      break;
  }
  throw std::runtime_error(error.message);
}

}  // namespace tagrid
