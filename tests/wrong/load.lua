-- expect: 3: attempt to call a nil value (global 'load')
local rd = require "refdyn"
local f = load("return 1")
