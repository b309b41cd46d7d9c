-- expect: 3: pairs
local rd = require "refdyn"
error("sandbox:12: pairs", 0)
