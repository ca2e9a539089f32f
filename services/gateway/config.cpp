#include "services/gateway/config.h"

#include "common/base/errors.h"
#include "services/gateway/web/guard.h"

namespace perdure::gateway {

void describe(Config& c, config::Fields& fields) {
  fields.text("http.address", c.web.address,
              {"address of the port; all interfaces: 0.0.0.0", "",
               "set http.token for any address other than loopback"});
  fields.integer("http.port", c.web.port, config::between(0, 65535),
                 {"the only port: page, /healthz, /metrics, WebSocket; 0: any free port"});
  fields.text("http.token", c.web.token,
              {"token for access, as ?token=… in the address; empty: access from this host only"});
  fields.texts("http.allowed_hosts", c.web.allowed_hosts,
               {"names that the Host header may have in addition to loopback and http.address"});
  fields.texts(
      "http.allowed_origins", c.web.allowed_origins,
      {"origins of foreign pages that may connect; the gateway's own page may always connect"});
  fields.integer("limits.clients", c.web.most_clients, config::between(1, 1024),
                 {"largest number of WebSocket clients at one time"});
  fields.integer(
      "limits.connections", c.web.most_connections, config::between(4, 4096),
      {"largest number of connections at one time; further ones are closed immediately"});
  fields.integer("limits.message", c.web.most_message_kb, config::between(1, 16384),
                 {"largest message of a client; a larger one ends its connection", "KiB"});
  fields.integer(
      "limits.events", c.web.most_events, config::between(1, 100000),
      {"largest number of events queued for a slow client; then the oldest are dropped"});
  fields.text(
      "page.folder", c.page_folder,
      {"folder of the built page; empty: share/perdure/viewer beside the program's folder"});
  fields.text("page.truth", c.page_truth,
              {"truth of a simulated drive, as the demo writes it"});
  fields.texts("image.cameras", c.cameras, {"cameras whose images are sent"});
  fields.number("image.rate", c.image_rate_hz, config::between(0.1, 60.0),
                {"highest rate of images", "Hz"});
  fields.integer("image.quality", c.image_quality, config::between(1, 100),
                 {"quality of JPEG; compressed images are sent unchanged"});
  fields.number("scene.rate", c.scene_rate_hz, config::between(0.1, 100.0),
                {"highest rate of objects and poses", "Hz"});
}

void verify(const Config& config) {
  if (config.web.token.empty() && !web::isLoopback(config.web.address)) {
    throw StartupError(
        ExitCode::kConfiguration,
        "http.address {} can be reached from elsewhere, and http.token is empty: set a token, or "
        "listen on 127.0.0.1 and forward the port (ssh -L 8765:localhost:8765 VEHICLE)",
        config.web.address);
  }
}

}  // namespace perdure::gateway
