-- expect: 3: attempt to call a nil value (global 'pcall')
local rd = require "refdyn"
pcall(error)
