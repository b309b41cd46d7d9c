-- expect: 3: not\nso
local rd = require "refdyn"
assert(false, "not\nso")
