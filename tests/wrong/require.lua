-- expect: 2: require: only "refdyn" can be required
local socket = require "socket"
