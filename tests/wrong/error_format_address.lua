-- expect: 3: string.format: %p shows an address, which differs from run to run
local rd = require "refdyn"
local s = string.format("%p", "x")
