-- expect: 3: turned \u{202E}back\u{2066}
local rd = require "refdyn"
error("turned \u{202E}back\u{2066}")
