#include "pipeline/library/failures.h"

#include <new>
#include <stdexcept>
#include <system_error>

#include "io/files/errors.h"

namespace tagrid::library {
namespace {

tagrid_status sorted(std::string& message) {
  try {
    throw;
  } catch (const BadArgument& bad) {
    message = bad.what;
    return TAGRID_INVALID_ARGUMENT;
  } catch (const Cancelled&) {
    message = "cancelled by the caller";
    return TAGRID_CANCELLED;
  } catch (const MemoryLimit& error) {
    message = error.what();
    return TAGRID_MEMORY_LIMIT;
  } catch (const UsageError& error) {
    message = error.what();
    return TAGRID_INVALID_ARGUMENT;
  } catch (const BrokenInput& error) {
    message = error.what();
    return TAGRID_BROKEN_INPUT;
  } catch (const WorldError& error) {
    message = error.what();
    return TAGRID_IO_ERROR;
  } catch (const std::bad_alloc&) {
    message = "out of memory";
    return TAGRID_OUT_OF_MEMORY;
  } catch (const std::length_error&) {
    message = "out of memory";
    return TAGRID_OUT_OF_MEMORY;
  } catch (const std::system_error& error) {
    message = error.what();
    return TAGRID_IO_ERROR;
  } catch (const std::exception& error) {
    message = error.what();
    return TAGRID_BUG;
  } catch (...) {
    message = "something that is no exception was thrown";
    return TAGRID_BUG;
  }
}

}  // namespace

tagrid_status failed(Messages& messages) noexcept {
  try {
    std::string message;
    const tagrid_status status = sorted(message);
    messages.set(std::move(message));
    return status;
  } catch (...) {
    // There is no memory for a message.
    return TAGRID_OUT_OF_MEMORY;
  }
}

}  // namespace tagrid::library
