-- expect: 3: attempt to index a nil value (global 'debug')
local rd = require "refdyn"
debug.sethook()
