#include "services/gateway/config.h"

#include "common/base/errors.h"
#include "services/gateway/web/guard.h"

namespace perdure::gateway {

void describe(Config& c, config::Fields& fields) {
  fields.text("http.address", c.web.address,
              {"where it listens; all interfaces: 0.0.0.0", "",
               "elsewhere than on loopback set http.token"});
  fields.integer(
      "http.port", c.web.port, config::between(0, 65535),
      {"the one port: page, /healthz, /metrics, WebSocket; 0: any that is free", "", ""});
  fields.text("http.token", c.web.token,
              {"who has it may look: ?token=… behind the address; empty: whoever is on this host"});
  fields.texts("http.allowed_hosts", c.web.allowed_hosts,
               {"names in the Host header besides those of loopback and of http.address"});
  fields.texts("http.allowed_origins", c.web.allowed_origins,
               {"pages from elsewhere that may connect; the gateway's own may"});
  fields.integer("limits.clients", c.web.most_clients, config::between(1, 1024),
                 {"WebSocket clients at one time", "", ""});
  fields.integer("limits.connections", c.web.most_connections, config::between(4, 4096),
                 {"connections at one time; more are closed at once", "", ""});
  fields.integer("limits.message", c.web.most_message_kb, config::between(1, 16384),
                 {"the longest message of a client; a longer one ends its connection", "KiB", ""});
  fields.integer("limits.events", c.web.most_events, config::between(1, 100000),
                 {"events that wait for a slow client; then it loses the oldest", "", ""});
  fields.text("page.folder", c.page_folder,
              {"the built page; empty: share/perdure/viewer beside the program's folder"});
  fields.texts("image.cameras", c.cameras, {"cameras whose images are shown"});
  fields.number("image.rate", c.image_rate_hz, config::between(0.1, 60.0),
                {"images are shown at most so often", "Hz", ""});
  fields.integer("image.quality", c.image_quality, config::between(1, 100),
                 {"of the JPEG; images that are compressed already stay as they are", "", ""});
  fields.number("scene.rate", c.scene_rate_hz, config::between(0.1, 100.0),
                {"objects and poses are shown at most so often", "Hz", ""});
}

void verify(const Config& config) {
  if (config.web.token.empty() && !web::isLoopback(config.web.address)) {
    throw StartupError(
        ExitCode::kConfiguration,
        "http.address " + config.web.address +
            " can be reached from elsewhere, and http.token is empty: set a token, "
            "or listen on 127.0.0.1 and forward the port (ssh -L 8765:localhost:8765 "
            "VEHICLE)");
  }
}

}  // namespace perdure::gateway
