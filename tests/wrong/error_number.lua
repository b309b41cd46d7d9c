-- expect: 3: 12
local rd = require "refdyn"
error(12)
