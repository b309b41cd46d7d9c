-- expect: 3: bytes \xFF\xC3
local rd = require "refdyn"
error("bytes \xFF\xC3")
